"""What does a dataset say about itself?

This room writes the card of a finished dataset.
"""
