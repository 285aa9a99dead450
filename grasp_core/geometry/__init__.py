"""How do polygons lie in their plane?

Plane polygons come in. Areas, cuts, hulls and convex pieces go out, and products of vectors for
kernels; nothing here knows about grasps.
"""
