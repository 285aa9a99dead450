"""Judges the grasps of a command by published tests, and shows what each says."""
