"""Is a dataset what it claims to be, and are its rows right?

Modules here take the folder of a finished dataset and return its faults: hashes that differ, rows
that the analysis contradicts, units of work whose rows differ when they are computed again.
"""
