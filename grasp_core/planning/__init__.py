"""Which grasps does a polyhedron have at a friction coefficient?

A request comes in: an object, a friction, methods and a limit. It becomes face quadruples, best
first, then placements, then certified grasps. A plan goes out: grasps with counts, or the reason
why there are none.
"""
