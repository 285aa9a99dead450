"""Which grasps does a polyhedron have at a friction coefficient?

A request comes in: an object, a friction, methods, a limit. It becomes quadruples of faces, best
first, then placements, then certified grasps; a plan with counts, or a proof of absence, goes out.
"""
