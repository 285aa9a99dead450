"""Answers what the numbers of known hands are."""
