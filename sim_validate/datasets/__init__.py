"""How are tables of grasps made, checked and read?

A configuration names many objects and several frictions; the tables of a dataset hold objects,
grasps and trials. `build` makes a dataset: the work is split into units, each one object at one
friction (`work_units`), which worker processes compute (`computing`, `making_rows`). Every finished
unit is kept, so that a build can be resumed (`resuming`); in the end the rows of all units become
the tables (`writing`). `verify` checks a dataset, `open_dataset` reads it, and `isaac` exports the
poses of its hand.
"""
