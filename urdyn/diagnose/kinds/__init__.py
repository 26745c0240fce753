"""What can be found: kinds by rules, their suspects, and the values in which it is said."""
