"""What does a dataset of grasps consist of?

A configuration names many objects and several frictions; the tables of a dataset hold objects,
grasps and trials. The package `building` makes a dataset, `verifying` checks it, `describing`
documents it.
"""
