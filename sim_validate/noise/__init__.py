"""Grasps when nothing is quite as planned: seeded noise, and how often they hold with it."""
