"""ROOM grasp_core/objects."""
