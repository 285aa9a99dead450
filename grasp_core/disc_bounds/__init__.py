"""ROOM grasp_core/disc_bounds."""
