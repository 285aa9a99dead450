"""ROOM sim_validate/simulation."""
