"""Where are points nearest to each other, inside, or connected?

Plane polygons, triangles and points come in. Polygons, distances, nearest points and connected
components go out; nothing here knows about grasps.
"""
