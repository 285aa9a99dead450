"""ROOM sim_validate/records."""
