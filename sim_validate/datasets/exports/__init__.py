"""The formats of other programs that a dataset is written in."""
