"""Judges recorded grasps, whoever made them."""
