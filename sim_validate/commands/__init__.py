"""What does each command do?

Each module here runs one or a few commands. A command takes an instance of its class of flags,
writes files and console output, and returns an exit code.
"""
