"""How are recorded grasps read, one module for each format?

`reading` has the table of formats, and finds the one of a file.
"""
