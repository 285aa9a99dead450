"""ROOM grasp_core/cones."""
