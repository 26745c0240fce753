"""Files <-> types; units are converted here and nowhere else."""
