"""Given four faces and four force cones, where do the contacts go?

Convex face pieces and force cones come in, one of each per finger. Placements go out, made by the
construction of one family (concurrent, pencil or regulus) or by the free method.
"""
