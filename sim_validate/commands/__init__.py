"""ROOM sim_validate/commands."""
