"""Is the simulator right under these settings?

The gate takes a setup, a friction and a size, and checks cases with known answers. If one check
fails, nothing is simulated.
"""
