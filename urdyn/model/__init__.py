"""Rigid-body dynamics by Pinocchio, and what stands between a joint's torque and its current."""
