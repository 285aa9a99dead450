"""What do people see of a run?

This room turns the folder of a run into charts, and into pages that open from disk.
"""
