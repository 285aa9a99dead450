"""How large can independent discs be at most, before any grasp is constructed?

Quadruples of faces come in, with force cones. Upper bounds on the radius go out; the best-first
search rests on them.
"""
