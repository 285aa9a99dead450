"""ROOM grasp_core/closure."""
