"""What does each command do?

Each command takes an instance of its class of flags. It writes files and tables on the console, and
returns an exit code.
"""
