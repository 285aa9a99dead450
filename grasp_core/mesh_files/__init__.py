"""What mesh files say, read strictly: one module a format, without libraries.

Each gives the triangles of a file, or says where it breaks the rules of its format. Nothing is
guessed, skipped or repaired. Polygons become fans around their first corner.
"""
