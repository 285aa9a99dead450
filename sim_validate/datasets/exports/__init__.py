"""How do other programs read a dataset?

A finished dataset, or one split of it, comes in. Files in the formats of other programs go out.
"""
