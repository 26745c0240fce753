"""The step from sample to sample: currents are compared, changes detected, states learnt."""
