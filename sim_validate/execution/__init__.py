"""Grasps executed as a robot would: one squeeze, true masses, and trials that move the palm."""
