"""Mesh files of any size made to cost as much time as they can for each of their bytes."""

import json
import zipfile

from tests.bad_input.mesh_texts import obj
from tests.bad_input.of_binary_meshes import glb, tree
from tests.bad_input.of_threemf import PLACE, archive, components, item, mesh, model, object_

HEAD = (
    b"ply\nformat %s 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
)
FACES = b"element face %d\nproperty list uchar uchar vertex_index\n"
LITTLE = b"binary_little_endian"


def repeated(piece, size, before=b"", after=b""):
    """A piece again and again between a beginning and an end."""
    return before + piece * max(1, (size - len(before) - len(after)) // len(piece)) + after


def counted_off(vertices, faces, size):
    """OFF text of as many vertex lines, or face lines, as fit."""
    count = size // len(vertices or faces)
    counts = (count, 0) if vertices else (3, count)
    body = vertices * count if vertices else b"0 0 0\n" * 3 + faces * count
    return b"OFF\n%d %d 0\n" % counts + body


def binary_ply(size, row, point=bytes(12)):
    """Binary PLY of so many equal rows of faces as fit."""
    return (
        HEAD % LITTLE
        + FACES % (size // len(row))
        + b"end_header\n"
        + point
        + row * (size // len(row))
    )


def many_elements_ply(size):
    """A PLY file has as many elements without rows as its header holds, before a long body."""
    elements = b"".join(
        b"element e%d 0\nproperty char a\n" % i for i in range(min(size // 64, 1800))
    )
    rows = size - len(elements)
    tail = b"element last %d\nproperty char a\n" % max(rows, 1)
    return HEAD % LITTLE + FACES % 0 + elements + tail + b"end_header\n" + bytes(12 + max(rows, 1))


def shared_vertices_glb(size):
    """Many parts of one triangle each among the same, many vertices."""
    parts = size // 2 // 60
    points = size // 2 // 12
    made = tree()
    made["meshes"] = [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}] * parts}]
    made["accessors"][0]["count"] = points
    made["accessors"][1]["count"] = 3
    made["bufferViews"] = [{"buffer": 0, "byteOffset": 0, "byteLength": 12 * points},
                           {"buffer": 0, "byteOffset": 12 * points, "byteLength": 4}]  # fmt: skip
    return glb(made, bytes(12 * points + 4))


def listed_glb(piece, size):
    return glb(
        json.dumps(tree())[:-1].encode()
        + b', "extras": ['
        + b",".join([piece] * (size // (len(piece) + 1)))
        + b"]}"
    )


def many_children_glb(size):
    made = tree()
    made["nodes"][0]["children"] = [0] * (size // 3)
    return glb(made)


def stored_3mf(xml):
    """A 3MF file that is as long as its model, more or less."""
    return archive((PLACE, xml), way=zipfile.ZIP_STORED)


def filled_3mf(piece, size, **more):
    """A 3MF file of a piece of XML again and again among its objects."""
    return stored_3mf(model(object_(mesh()) + piece * (size // len(piece)), **more))


def chain_3mf(size):
    """Objects, each of which is a component of the next, twice; and none of them is built."""
    inside = "".join(object_(components(i, i), i + 1) for i in range(1, size // 90))
    return stored_3mf(model(object_(mesh()) + inside, item(size // 90)))


OBJ = obj().encode()
FILES = {
    "obj: vertices": lambda n: repeated(b"v 0 0 0\n", n, OBJ),
    "obj: one polygon": lambda n: repeated(b" 1", n, OBJ + b"f", b"\n"),
    "obj: a line of hashes before a letter": lambda n: repeated(b"#", n, OBJ, b"\\\nv"),
    "obj: a long number that is none": lambda n: repeated(b"1", n, OBJ + b"v ", b"x 0 0\n"),
    "obj: many long numbers": lambda n: repeated(b"v 0 0 0." + b"1" * 700 + b"e-300\n", n, OBJ),
    "stl: triangles": lambda n: repeated(
        b"facet normal\nouter loop\n" + b"vertex 0 0 0\n" * 3 + b"endloop\nendfacet\n", n,
        b"solid\n", b"endsolid\n"),
    "stl: a long number that is none": lambda n: repeated(
        b"1", n, b"solid\nfacet normal 0 0 0\nouter loop\nvertex ", b"x 0 0\n"),
    "off: vertices": lambda n: counted_off(b"0 0 0\n", b"", n),
    "off: one polygon": lambda n: b"OFF\n3 1 0\n" + b"0 0 0\n" * 3 + b"%d" % (n // 2)
    + b" 0" * (n // 2),
    "ply: spaces before a missing end": lambda n: repeated(b"\nend_header ", n, b"ply"),
    "ply: many elements": many_elements_ply,
    "ply: binary triangles": lambda n: binary_ply(n, b"\3\0\0\0"),
    "ply: binary faces that differ": lambda n: binary_ply(n, b"\3\0\0\0\4\0\0\0\0"),
    "glb: deep lists": lambda n: glb(b"[" * n),
    "glb: empty lists": lambda n: listed_glb(b"[]", n),
    "glb: a long string without an end": lambda n: glb(b'"' + b"\\" * n),
    "glb: parts among shared vertices": shared_vertices_glb,
    "glb: many children": many_children_glb,
    "3mf: vertices": lambda n: stored_3mf(model(object_(mesh([(0, 0, 0)] * (n // 30), [])))),
    "3mf: triangles": lambda n: stored_3mf(model(object_(mesh(faces=[(0, 2, 1)] * (n // 35))))),
    "3mf: empty elements": lambda n: filled_3mf("<a xmlns=''/>", n),
    "3mf: comments": lambda n: filled_3mf("<!---->", n),
    "3mf: one tag": lambda n: stored_3mf(model(more="".join(f'a{i}="" ' for i in range(n // 9)))),
    "3mf: many names": lambda n: filled_3mf("<metadata/>", n),
    "3mf: one text": lambda n: filled_3mf(" ", n),
    "3mf: components of components": chain_3mf,
    "3mf: items": lambda n: stored_3mf(model(items=item() * (n // 70))),
    "3mf: empty parts": lambda n: archive(
        *((f"{i}", "") for i in range(n // 100)), way=zipfile.ZIP_STORED),
    "3mf: words of slicers": lambda n: archive(
        ("Metadata/a_model.config", '"volume_type"' + " " * n), (PLACE, ""),
        way=zipfile.ZIP_STORED),
}  # fmt: skip
"""Makers of files of about so many bytes, by format and what makes them slow."""
