"""What do people see of a run?

The folder of a run comes in. Charts and pages go out that open from disk.
"""
