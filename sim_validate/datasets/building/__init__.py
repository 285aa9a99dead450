"""ROOM sim_validate/datasets/building."""
