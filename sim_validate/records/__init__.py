"""What does each file hold that is written or read?

One module per format turns verdicts, regions, setups or wrenches into text, or text into checked
values. Its schema is part of it.
"""
