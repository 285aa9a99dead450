"""Readers of mesh files as targets, against another reading, and the making of solids."""

import io
import struct
from functools import partial

import numpy as np
import trimesh

import grasp_core as gc
from grasp_core.mesh_files.limits import MESH_FORMATS
from grasp_core.mesh_files.reading import mesh_of_bytes
from tests.bad_input.mesh_texts import CORNERS, TRIANGLES
from tests.bad_input.of_binary_meshes import glb, tree
from tests.bad_input.of_threemf import components, item, model, object_, threemf
from tests.bad_input.of_threemf import mesh as mesh_xml
from tests.fuzzing.array_files import npz
from tests.fuzzing.plain_meshes import PLAIN
from tests.fuzzing.targets import Target

MOST = 10_000
"""Triangles of a fuzzed file."""
ROUNDING = 1e-9
VOLUME_ROUNDING = 1e-6


def triangles_of(kind, data, most=MOST):
    """The vertices and triangles of a file's bytes."""
    mesh = mesh_of_bytes(kind, data, most)
    return mesh.vertices, mesh.triangles


def first_least(corners):
    """The nine numbers of a triangle, from its least corner on, as it is wound."""
    points = [tuple(float(x) + 0.0 for x in point) for point in corners]
    return min(sum(points[k:] + points[:k], ()) for k in range(3))


def same_triangles(kind, data, found):
    """All coordinates are those of the plain reading, triangle by triangle, in any order."""
    points, corners = found
    rows = sorted(first_least(each) for each in points[corners])
    plain = sorted(first_least(each) for each in PLAIN[kind](data))
    assert len(rows) == len(plain), (len(rows), len(plain))
    if rows == plain:
        return
    assert kind in {"glb", "3mf"}  # products of matrices are rounded
    one, other = (np.array(each).reshape(-1, 3, 3) for each in (rows, plain))
    gap = [
        np.abs(np.roll(one, k, axis=1)[:, None] - other[None]).max(axis=(2, 3)) for k in range(3)
    ]
    near = np.min(gap, axis=0) <= ROUNDING * np.abs(other).max()
    assert near.any(axis=0).all()
    assert near.any(axis=1).all()


def tetrahedron():
    return trimesh.Trimesh(CORNERS, TRIANGLES)


OBJ = """# a wedge
mtllib a.mtl
o wedge
v 0 0 0
v 1e-1 0 0 1
v .1 .1 0
v 0 +0.1 0.0
v 0 0 .05 0.5 0.5 0.5
v 1.0E-01 0 5e-2
vn 0 0 1
vt 0 0
g base
f 1/1/1 4/1/1 3/1/1 2/1/1
f 5 6 3 4
f 1//1 2//1 6//1 \\
5//1
f 2 3 6
f -6 -2 -3
"""
OFF = "OFF 4 4 6\n0 0 0\n.1 0 0\n0 .1 0 # a comment\n0 0 1e-1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n"
PLY = """ply
format ascii 1.0
comment four faces
element vertex 4
property float x
property double y
property float32 z
element face 4
property uchar red
property list uchar int vertex_indices
end_header
0 0 0
.1 0 0
0 .1 0
0 0 1e-1
1 3 0 2 1
2 3 0 1 3
3 3 0 3 2
4 3 1 2 3
"""


def big_endian():
    faces = tetrahedron().faces
    head = PLY.split("end_header")[0].replace("ascii", "binary_big_endian")
    head = head.replace("property uchar red\n", "") + "end_header\n"
    rows = [struct.pack(">fdf", *point) for point in tetrahedron().vertices.tolist()]
    return head.encode() + b"".join(rows + [struct.pack(">B3i", 3, *face) for face in faces])


def moved_scene():
    """A node above a mesh, turned, stretched and moved."""
    scene = tree()
    turned = {"rotation": [0.6, 0, 0, 0.8], "translation": [1, 2, 3], "scale": [1, 2, -1]}
    scene["nodes"].append(turned | {"children": [0]})
    scene["scenes"][0]["nodes"] = [1]
    return glb(scene)


def placed_twice():
    """A 3MF file of a mesh in two places, as a part of a part and by itself, mirrored."""
    objects = object_(mesh_xml()) + object_(components(1, more=f'transform="{TURNED}"'), 2)
    return threemf(model(objects, item(2, TURNED) + item(1, "1 0 0 0 -1 0 0 0 1 -1 0 0"), ""))


TURNED = "0 2 0 -1 0 0 0 0 1 5 6 .5"
SEEDS = {
    "obj": lambda: [OBJ.encode(), tetrahedron().export(file_type="obj").encode()],
    "stl": lambda: [tetrahedron().export(file_type=kind) for kind in ("stl", "stl_ascii")],
    "off": lambda: [OFF.encode(), tetrahedron().export(file_type="off").encode()],
    "ply": lambda: [
        PLY.encode(), big_endian(), tetrahedron().export(file_type="ply"),
        tetrahedron().export(file_type="ply", encoding="ascii"),
    ],
    "glb": lambda: [tetrahedron().export(file_type="glb"), moved_scene()],
    "3mf": lambda: [threemf(), placed_twice()],
}  # fmt: skip
WRITTEN = {
    "obj": "words", "off": "words", "glb": "glb", "stl": "words", "ply": "words", "3mf": "3mf"
}  # fmt: skip


def seeds(kind):
    return [data if isinstance(data, bytes) else data.encode() for data in SEEDS[kind]()]


UNMENDED = ("dropped", "the mesh was inside out")
"""Beginnings of notes on repairs that leave extent and volume as they are."""


def solid(data):
    """A solid of an archive of vertices and triangles."""
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as held:
            vertices, triangles = held["vertices"], held["triangles"]
    except Exception as error:  # an archive that is none is no business of this target
        raise gc.InputError("no archive") from error
    if len(triangles) > MOST:
        raise gc.InputError("too many")
    return gc.Polyhedron.from_mesh(vertices, triangles), vertices, triangles


def same_volume(_, found):
    """The extent and volume are those of the triangles that were given, unless they were mended."""
    body, vertices, triangles = found
    corners = np.asarray(vertices, dtype=np.float64)[triangles]
    volume = abs(np.linalg.det(corners - corners.mean(axis=(0, 1))).sum() / 6.0)
    extent = float(np.ptp(corners.reshape(-1, 3), axis=0).max())
    as_given = all(note.startswith(UNMENDED) for note in body.surface.repairs)
    if body.patches is None and as_given and not body.surface.holes:
        assert abs(body.volume - volume) <= VOLUME_ROUNDING * extent**3
        assert np.allclose(np.ptp(body.vertices, axis=0).max(), extent, rtol=1e-6)
    assert all(np.isfinite(face.normal).all() and face.area > 0.0 for face in body.faces)


def solid_seeds():
    meshes = tetrahedron(), trimesh.creation.box(extents=(0.1, 0.2, 0.3))
    return [npz(vertices=mesh.vertices, triangles=mesh.faces) for mesh in meshes]


TARGETS = [
    *(Target(kind, *(partial(each, kind) for each in (triangles_of, seeds, same_triangles)),
             WRITTEN[kind]) for kind in MESH_FORMATS),
    Target("solid", solid, solid_seeds, same_volume, "npz"),
]  # fmt: skip
