"""How is a dataset made, on one machine or many, and resumed?

A configuration becomes staged units of work, and these become whole tables.
"""
