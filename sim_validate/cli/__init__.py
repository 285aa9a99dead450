"""ROOM sim_validate/cli."""
