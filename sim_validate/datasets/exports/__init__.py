"""How can other programs read a dataset?

Modules here write a finished dataset, or one split of it, in the formats of other programs.
"""
