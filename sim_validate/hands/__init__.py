"""Trials of real hands: what their motors are predicted to hold is held in simulation, no more."""
