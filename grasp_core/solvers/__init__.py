"""ROOM grasp_core/solvers."""
