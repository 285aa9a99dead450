"""How is a dataset made, on one machine or many, and resumed after an interruption?

The work is split into units: one object at one friction each. Every finished unit is kept in a
staging folder; in the end the rows of all units become the tables of the dataset.
"""
