"""ROOM grasp_core/families."""
