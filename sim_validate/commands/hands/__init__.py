"""Runs the commands about hands; each module has a command's name."""
