"""Given four faces and four cones, where do the contacts go?

Convex face pieces and force cones come in, one of each per finger. Placements go out by the
construction of one family: concurrent, pencil, regulus, or free of any.
"""
