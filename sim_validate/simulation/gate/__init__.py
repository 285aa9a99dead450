"""ROOM sim_validate/simulation/gate."""
