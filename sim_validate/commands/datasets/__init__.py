"""Runs the commands that merge datasets and that show what they hold."""
