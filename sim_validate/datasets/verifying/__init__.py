"""Is a dataset what it says, and are its rows right?

This room takes the folder of a finished dataset and returns its faults: hashes that differ, rows
that the analysis contradicts, units that come out otherwise when they are computed again.
"""
