"""Which flags does the command line take, and what does it answer?

This room turns arguments and config files into checked flags, and results into console output and
exit codes.
"""
