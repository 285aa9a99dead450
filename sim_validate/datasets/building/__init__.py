"""How is a dataset made, on one machine or many, and resumed?

A configuration comes in. Staged units and then whole tables go out.
"""
