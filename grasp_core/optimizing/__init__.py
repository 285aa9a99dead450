"""ROOM grasp_core/optimizing."""
