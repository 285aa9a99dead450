"""ROOM grasp_core/planning."""
