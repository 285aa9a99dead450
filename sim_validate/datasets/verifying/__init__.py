"""Is a dataset what it says, and are its rows right?

The folder of a finished dataset comes in. Faults go out: hashes that differ, rows that the analysis
contradicts, units that come out otherwise when made again.
"""
