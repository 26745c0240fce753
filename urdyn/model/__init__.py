"""Rigid-body dynamics by Pinocchio, and what lies between a joint's torque and its current."""
