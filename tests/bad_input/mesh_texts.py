"""Mesh files by hand: a tetrahedron a decimetre across, and ways to spoil it."""

import struct

CORNERS = [(0.0, 0.0, 0.0), (0.1, 0.0, 0.0), (0.0, 0.1, 0.0), (0.0, 0.0, 0.1)]
TRIANGLES = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]


def obj(corners=CORNERS, faces=TRIANGLES, more=""):
    """An OBJ text."""
    lines = ["v " + " ".join(f"{x!r}" for x in each) for each in corners]
    lines += ["f " + " ".join(str(i + 1) for i in each) for each in faces]
    return "\n".join(lines) + "\n" + more


def stl(corners=CORNERS, faces=TRIANGLES, head=b"by hand"):
    """A binary STL file."""
    rows = [struct.pack("<12fH", 0, 0, 0, *(x for i in f for x in corners[i]), 0) for f in faces]
    return head.ljust(80, b"\0") + struct.pack("<I", len(faces)) + b"".join(rows)


def stl_text(corners=CORNERS, faces=TRIANGLES):
    """A text STL file."""
    facets = [
        "facet normal 0 0 0\nouter loop\n"
        + "".join("vertex " + " ".join(map(repr, corners[i])) + "\n" for i in face)
        + "endloop\nendfacet\n"
        for face in faces
    ]
    return "solid hand\n" + "".join(facets) + "endsolid hand\n"


def off(counts="4 4 6", corners=CORNERS, faces=TRIANGLES):
    """An OFF text."""
    rows = [" ".join(map(repr, each)) for each in corners]
    rows += [" ".join(map(str, (len(each), *each))) for each in faces]
    return "\n".join(["OFF", counts, *rows]) + "\n"


def ply(vertices=4, faces=4, kind="float", form="ascii", body=None):
    """A PLY file."""
    head = (
        f"ply\nformat {form} 1.0\nelement vertex {vertices}\n"
        + "".join(f"property {kind} {axis}\n" for axis in "xyz")
        + f"element face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    if body is None:
        rows = [" ".join(map(repr, each)) for each in CORNERS]
        rows += [" ".join(map(str, (3, *each))) for each in TRIANGLES]
        body = ("\n".join(rows) + "\n").encode()
    return head.encode() + body


def ply_binary(order="<", code="f"):
    """The rows of a binary PLY file."""
    rows = [struct.pack(order + 3 * code, *each) for each in CORNERS]
    return b"".join(rows + [struct.pack(order + "B3i", 3, *each) for each in TRIANGLES])


def box(low, size, first=0):
    """Corners and triangles of a box."""
    x, y, z = low
    points = [
        (x + size * i, y + size * j, z + size * k) for i in (0, 1) for j in (0, 1) for k in (0, 1)
    ]
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return points, [tuple(first + i for i in quad) for quad in quads]


def boxes(*placed):
    """Corners and faces of several boxes."""
    points, faces = [], []
    for low, size in placed:
        more, quads = box(low, size, len(points))
        points += more
        faces += quads
    return points, faces


def turned(faces):
    """Faces wound the other way."""
    return [face[::-1] for face in faces]
