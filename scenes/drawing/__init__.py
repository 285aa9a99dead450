"""ROOM scenes/drawing."""
