"""Datasets: many objects at several frictions, planned, simulated and written as tables."""
