"""How are tables of grasps made, checked and read?

A configuration names many objects and several frictions; the tables of a dataset hold objects,
grasps and trials. The work is split into units: one object at one friction each. Every finished
unit is kept in a staging folder; in the end the rows of all units become the tables. `build` makes
a dataset, `verify` checks it, and `open_dataset` reads it.
"""
