"""What does a dataset say about itself?

A finished dataset comes in. Its card and its description for catalogues go out.
"""
