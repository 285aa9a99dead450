"""ROOM sim_validate/parallel."""
