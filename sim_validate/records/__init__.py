"""What is in each file that is written or read?

Verdicts, regions, setups and wrenches come in, or the text of their files. Text goes out, or
checked values: one module a format, its schema included.
"""
