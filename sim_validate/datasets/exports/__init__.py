"""How do other programs read a dataset?

This room writes a finished dataset, or one split of it, in the formats of other programs.
"""
