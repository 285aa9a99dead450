"""How do triangles become a polyhedron with faces?

The triangles of a mesh come in, with the tolerances of flatness. A `Polyhedron` goes out, with its
faces, its mass properties and notes on what was mended, or a refusal with a reason.
"""
