"""ROOM sim_validate/gate."""
