"""ROOM grasp_core/regions."""
