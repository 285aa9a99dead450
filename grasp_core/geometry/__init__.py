"""ROOM grasp_core/geometry."""
