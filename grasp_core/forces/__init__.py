"""ROOM grasp_core/forces."""
