"""Runs the commands that show what datasets hold."""
