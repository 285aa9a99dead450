"""ROOM grasp_core/files."""
