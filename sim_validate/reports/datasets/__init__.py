"""What does a finished dataset hold, at a glance?

Modules here write pages about the distributions of a dataset's columns, and about a few rows of it.
"""
