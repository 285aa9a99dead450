"""How large can independent discs be at most, before any grasp is constructed?

Quadruples of faces come in, with force cones. Upper bounds on the radius go out, by which the
best-first search chooses what to construct.
"""
