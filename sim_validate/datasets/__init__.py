"""What is a dataset of grasps?

A configuration names many objects and several frictions; the tables of a dataset hold objects,
grasps and trials. `building` makes them, `verifying` checks them, `describing` documents them, and
`exports` writes them for other programs.
"""
