"""Which flags does the command line take, and what does it print?

Modules here turn arguments and config files into checked flags, and results into console output and
exit codes.
"""
