"""How an object moves when forces act on it between fingertips, and what its motion means."""
