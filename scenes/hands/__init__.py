"""Scenes of a hand that stands in a grasp: its real chains of links, moved by servos with limits."""
