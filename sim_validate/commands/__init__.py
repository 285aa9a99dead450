"""What does each command do?

Flags come in, one class a command. Files, tables on the console and an exit code go out.
"""
