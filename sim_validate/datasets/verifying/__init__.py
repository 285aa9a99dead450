"""ROOM sim_validate/datasets/verifying."""
