"""What does each file hold that is written or read?

Each module is about one file format: it turns verdicts, regions, setups or wrenches into text, or
text into checked values, and defines the fields of the file.
"""
