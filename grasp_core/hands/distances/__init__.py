"""Answers how far a hand is from itself, from an object and from a table."""
