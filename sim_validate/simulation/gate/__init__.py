"""Does the simulator give right answers with these settings?

Modules here form the gate: checks of the simulator on cases whose answers are known from statics.
They take the settings, a friction and an object size. If one check fails, no grasp is simulated.
"""
