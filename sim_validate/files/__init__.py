"""ROOM sim_validate/files."""
