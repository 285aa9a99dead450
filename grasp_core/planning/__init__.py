"""Which grasps does a polyhedron have at a friction coefficient?

The request names an object, a friction, methods and a limit. The planner ranks sets of four faces
by the grasps they may hold, places contacts on the most promising ones first, and certifies each
grasp exactly. The plan lists the grasps with counts, or the reason why there are none.
"""
