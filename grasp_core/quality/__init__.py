"""ROOM grasp_core/quality."""
