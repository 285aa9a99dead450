"""ROOM sim_validate/validation."""
