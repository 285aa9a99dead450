"""What triangles does a mesh file hold, or where does it break its format?

The bytes of an OBJ, STL, PLY, OFF, GLB or 3MF file come in. Triangles go out, polygons as fans
around their first corner, or a refusal with its reason. Nothing is guessed, skipped or repaired.
"""
