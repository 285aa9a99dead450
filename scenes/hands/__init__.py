"""Scenes of a hand that stands in a grasp: its chains of links, moved by limited servos."""
