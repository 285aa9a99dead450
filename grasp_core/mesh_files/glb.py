"""Reads GLB files (binary glTF): a JSON chunk names nodes and meshes, a binary chunk holds numbers.

The pose of a mesh is the product of the matrices from the root of its scene down to its node. Where
this matrix mirrors, the triangles are wound the other way, so that normals still point outwards.
Features that would change the shape and are not read (compression, sparse accessors, skins, morph
targets, external files) are refused.

Several nodes may place the same mesh, and meshes may share their numbers. To keep a small file from
becoming a huge scene, every primitive that is placed counts for at least one triangle of the limit.
"""

import json
import struct
from collections.abc import Iterator
from typing import cast

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.errors import MeshError, MeshRefusal
from grasp_core.mesh_files.glb_primitives import Tree, check_place, decoded_primitive
from grasp_core.mesh_files.polygon_soup import too_many
from grasp_core.mesh_files.refusals import broken, not_finite, shown, unsupported

MAGIC, VERSION = b"glTF", 2
HEAD, CHUNK_HEAD = 12, 8
JSON_CHUNK, BINARY_CHUNK = 0x4E4F534A, 0x004E4942
MOST_NODES = 10_000
MOST_VALUES = 4_000_000
"""Largest number of JSON values allowed: each of them takes up to a quarter of a kilobyte of
memory."""
PLAIN_EXTENSIONS = ("KHR_materials", "KHR_texture", "KHR_lights", "EXT_texture", "KHR_xmp")
"""Prefixes of glTF extensions that change only the appearance; files with others are refused."""
WRONG_TREE = (
    KeyError, IndexError, TypeError, ValueError, AttributeError, OverflowError, RecursionError,
)  # fmt: skip
"""Errors that Python raises while reading JSON whose keys or values are not those of glTF."""


def read(data: bytes, most: int) -> tuple[Array, Indices, int]:
    """Read the vertices (n, 3) and triangles (t, 3) of a GLB file's default scene; no digits."""
    tree, binary = _chunks(data)
    try:
        with np.errstate(over="ignore", invalid="ignore"):  # what is not finite is refused
            return *_scene(tree, binary, most), 0
    except WRONG_TREE as error:
        message = f"the JSON part of the file is not glTF ({type(error).__name__}: {shown(error)})"
        raise MeshError(MeshRefusal.UNREADABLE, f"{message}; export it again") from error


def _chunks(data: bytes) -> tuple[Tree, bytes]:
    """Split a GLB file into its JSON tree and its binary chunk, which may be empty."""
    if len(data) < HEAD:
        broken("the header", f"expected {HEAD} bytes, got {len(data)}")
    magic, version, length = struct.unpack_from("<4sII", data)
    if magic != MAGIC or version != VERSION or length != len(data):
        got = f"got glTF {version} and {length} bytes"
        broken("the header", f"expected glTF 2 and a length of {len(data)} bytes, {got}")
    chunks, place = list[tuple[int, bytes]](), HEAD
    while place < len(data):
        if place + CHUNK_HEAD > len(data):
            broken("the end", "the head of a chunk is cut off")
        size, kind = struct.unpack_from("<II", data, place)
        place += CHUNK_HEAD + size
        if place > len(data):
            broken("the end", f"a chunk of {size} bytes is cut off")
        chunks.append((kind, data[place - size : place]))
    if [kind for kind, _ in chunks] not in ([JSON_CHUNK], [JSON_CHUNK, BINARY_CHUNK]):
        broken("the chunks", "expected one JSON chunk, then at most one binary chunk")
    return _tree(chunks[0][1]), chunks[1][1] if len(chunks) > 1 else b""


def _tree(text: bytes) -> Tree:
    if sum(map(text.count, (b",", b"[", b"{"))) > MOST_VALUES:
        message = f"the JSON part has over {MOST_VALUES} values, the limit; simplify the mesh"
        raise MeshError(MeshRefusal.TOO_MANY, message)
    try:
        tree: object = json.loads(text.decode("utf-8"))
    except (ValueError, RecursionError) as error:
        message = f"the first chunk is not JSON ({shown(error)}); export it again"
        raise MeshError(MeshRefusal.UNREADABLE, message) from error
    if not isinstance(tree, dict):
        broken("the first chunk", "expected a JSON object")
    return cast("Tree", tree)


def _scene(tree: Tree, binary: bytes, most: int) -> tuple[Array, Indices]:
    _check_features(tree)
    points, triangles = [np.empty((0, 3))], [np.empty((0, 3), dtype=np.int64)]
    before = placed = 0
    for matrix, mesh in _placed(tree):
        mirrored = np.linalg.det(matrix[:3, :3]) < 0.0
        for primitive in tree["meshes"][mesh]["primitives"]:
            corners, local = decoded_primitive(tree, binary, primitive, most - placed)
            placed += max(len(corners), 1)
            if placed > most:
                too_many(placed, most)
            points.append(local @ matrix[:3, :3].T + matrix[:3, 3])
            triangles.append(before + (corners[:, ::-1] if mirrored else corners))
            before += len(local)
    moved = np.vstack(points)
    if not np.isfinite(moved).all():
        message = "a coordinate of the scene is infinite or not a number; repair the mesh"
        raise MeshError(MeshRefusal.NON_FINITE, message)
    return moved, np.vstack(triangles)


def _check_features(tree: Tree) -> None:
    buffers = tree.get("buffers", [])
    if len(buffers) > 1 or any("uri" in buffer for buffer in buffers):
        unsupported("the numbers lie outside the binary chunk", "export one GLB that holds them")
    used = [*tree.get("extensionsRequired", ()), *tree.get("extensionsUsed", ())]
    for name in used:
        if not str(name).startswith(PLAIN_EXTENSIONS):
            unsupported(f"extension {shown(name)!r}", "export plain glTF, without compression")
    if any("skin" in node or "weights" in node for node in tree.get("nodes", [])):
        unsupported("a node has a skin or morph weights", "export the mesh in its final shape")


def _placed(tree: Tree) -> Iterator[tuple[Array, int]]:
    """Yield the 4x4 pose matrix and the index of each mesh in the default scene."""
    scenes = tree.get("scenes", [])
    if not scenes:
        return
    place = tree.get("scene", 0)
    check_place(place, scenes)
    waiting, seen = list[tuple[Array, int]](), set[int]()
    _await(waiting, np.eye(4), scenes[place].get("nodes", []))
    while waiting:
        parent, number = waiting.pop()
        check_place(number, tree["nodes"])
        if number in seen or len(seen) >= MOST_NODES:
            broken(f"node {number}", f"nodes must form a tree of at most {MOST_NODES} nodes")
        seen.add(number)
        node = tree["nodes"][number]
        matrix = parent @ _matrix(node)
        _await(waiting, matrix, node.get("children", []))
        if "mesh" in node:
            check_place(node["mesh"], tree["meshes"])
            if "camera" in node:
                unsupported(f"node {number} holds a mesh and a camera", "export the mesh alone")
            yield matrix, node["mesh"]


def _await(waiting: list[tuple[Array, int]], matrix: Array, nodes: list[int]) -> None:
    if len(waiting) + len(nodes) > MOST_NODES:
        broken("the JSON part", f"nodes must form a tree of at most {MOST_NODES} nodes")
    waiting += [(matrix, number) for number in nodes]


def _matrix(node: Tree) -> Array:
    matrix = np.eye(4)
    if "matrix" in node:
        if {"translation", "rotation", "scale"} & node.keys():
            broken("a node", "it has a matrix as well as a translation, rotation or scale")
        # glTF lists matrices by columns
        matrix = _floats(node, "matrix", 16).reshape(4, 4).T
        if (matrix[3] != (0.0, 0.0, 0.0, 1.0)).any():
            unsupported(
                "the last row of a node's matrix is not 0 0 0 1", "export it without perspective"
            )
        return matrix
    if "rotation" in node:
        matrix[:3, :3] = _rotation(_floats(node, "rotation", 4))
    if "scale" in node:
        matrix[:3, :3] *= _floats(node, "scale", 3)
    if "translation" in node:
        matrix[:3, 3] = _floats(node, "translation", 3)
    return matrix


def _floats(node: Tree, name: str, count: int) -> Array:
    given = node[name]
    if len(given) != count or any(type(each) not in (int, float) for each in given):
        broken("a node", f"its {name} must be {count} numbers, got {shown(given)}")
    values = np.array([float(each) for each in given])
    if not np.isfinite(values).all():
        not_finite("a node", f"its {name} must be finite", shown(given))
    return values


def _rotation(quaternion: Array) -> Array:
    """Convert a quaternion (x, y, z, w) of any length to a rotation matrix, (3, 3)."""
    size = float(np.linalg.norm(quaternion))
    if not 0.5 < size < 2.0:  # noqa: PLR2004 - rounding does not get there
        broken("a node", f"its rotation is a quaternion of length {size:.3g}, expected 1")
    x, y, z, w = quaternion / size
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
