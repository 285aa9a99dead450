"""What do all promises share: flags and the console, files and folders, processes?

Modules here turn arguments into checked flags and results into console output and exit codes, read
and write text, arrays and locked folders, and spread work over processes and machines, in order and
with the same results for any number of them. None knows about simulations.
"""
