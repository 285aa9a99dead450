"""What can be said on the command line, and what is answered?

Arguments and config files come in. Checked flags, exit codes and console output go out.
"""
