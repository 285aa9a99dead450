"""ROOM grasp_core/records."""
