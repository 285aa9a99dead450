"""Which commands are there, which flags do they take, and what do they print and return?

Modules here turn arguments into checked flags, and results into console output and exit codes.
"""
