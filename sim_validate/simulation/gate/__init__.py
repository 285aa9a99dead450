"""Is the simulator right under these settings?

A setup comes in, with a friction and a size. Checks of cases with known answers go out; if one
fails, nothing is simulated.
"""
