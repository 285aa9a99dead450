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
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array, Indices
from grasp_core.errors import MeshError, MeshRefusal
from grasp_core.mesh_files.polygon_soup import CORNERS, too_many
from grasp_core.mesh_files.refusals import broken, not_finite, outside, shown, unsupported

MAGIC, VERSION = b"glTF", 2
HEAD, CHUNK_HEAD = 12, 8
JSON_CHUNK, BINARY_CHUNK = 0x4E4F534A, 0x004E4942
INDEX_TYPES = {5121: "<u1", 5123: "<u2", 5125: "<u4"}
FLOAT_TYPE = 5126
TRIANGLES, STRIP = 4, 5
MOST_NODES = 10_000
MOST_VALUES = 4_000_000
"""Most JSON values allowed: each of them takes up to a quarter of a kilobyte of memory."""
PLAIN_EXTENSIONS = ("KHR_materials", "KHR_texture", "KHR_lights", "EXT_texture", "KHR_xmp")
"""Prefixes of glTF extensions that change only the appearance; files with others are refused."""
Tree = dict[str, Any]
WRONG_TREE = (
    KeyError, IndexError, TypeError, ValueError, AttributeError, OverflowError, RecursionError,
)  # fmt: skip
"""Errors that Python raises while reading JSON whose keys or values are not those of glTF."""


def read(data: bytes, most: int) -> tuple[Array, Indices]:
    """Read the vertices (n, 3) and triangles (t, 3) of a GLB file's default scene.

    Raises:
        MeshError: The file breaks a rule, or has more than `most` triangles.
    """
    tree, binary = _chunks(data)
    try:
        with np.errstate(over="ignore", invalid="ignore"):  # what is not finite is refused
            return _scene(tree, binary, most)
    except WRONG_TREE as error:
        message = f"the JSON part is no glTF ({type(error).__name__}: {shown(error)})"
        raise MeshError(MeshRefusal.UNREADABLE, f"{message}; export it again") from error


def _chunks(data: bytes) -> tuple[Tree, bytes]:
    """Split a GLB file into its JSON tree and its binary chunk, which may be empty."""
    if len(data) < HEAD:
        broken("the head", f"expected {HEAD} bytes")
    magic, version, length = struct.unpack_from("<4sII", data)
    if magic != MAGIC or version != VERSION or length != len(data):
        broken("the head", f"expected glTF 2 of {len(data)} bytes, got {version} of {length}")
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
            corners, local = _primitive(tree, binary, primitive, most - placed)
            placed += max(len(corners), 1)
            if placed > most:
                too_many(placed, most)
            points.append(local @ matrix[:3, :3].T + matrix[:3, 3])
            triangles.append(before + (corners[:, ::-1] if mirrored else corners))
            before += len(local)
    moved = np.vstack(points)
    if not np.isfinite(moved).all():
        message = "a coordinate of the scene is not finite; repair it"
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
    """Yield the 4x4 pose matrix and the index of each mesh in the default scene.

    Raises:
        MeshError: The nodes do not form a tree, or there are too many.
    """
    scenes = tree.get("scenes", [])
    if not scenes:
        return
    place = tree.get("scene", 0)
    _check_place(place, scenes)
    waiting, seen = list[tuple[Array, int]](), set[int]()
    _await(waiting, np.eye(4), scenes[place].get("nodes", []))
    while waiting:
        parent, number = waiting.pop()
        _check_place(number, tree["nodes"])
        if number in seen or len(seen) >= MOST_NODES:
            broken(f"node {number}", f"nodes must form a tree, of {MOST_NODES} at most")
        seen.add(number)
        node = tree["nodes"][number]
        matrix = parent @ _matrix(node)
        _await(waiting, matrix, node.get("children", []))
        if "mesh" in node:
            _check_place(node["mesh"], tree["meshes"])
            if "camera" in node:
                unsupported(f"node {number} holds a mesh and a camera", "export the mesh alone")
            yield matrix, node["mesh"]


def _await(waiting: list[tuple[Array, int]], matrix: Array, nodes: list[int]) -> None:
    if len(waiting) + len(nodes) > MOST_NODES:
        broken("the JSON part", f"nodes must form a tree, of {MOST_NODES} at most")
    waiting += [(matrix, number) for number in nodes]


def _check_place(place: object, listed: list[Any]) -> None:
    if type(place) is not int or not 0 <= place < len(listed):
        broken("the JSON part", f"refers to item {shown(place)} of a list of {len(listed)}")


def _matrix(node: Tree) -> Array:
    matrix = np.eye(4)
    if "matrix" in node:
        if {"translation", "rotation", "scale"} & node.keys():
            broken("a node", "has a matrix as well as a translation, rotation or scale")
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
    """The rotation matrix, (3, 3), of a quaternion (x, y, z, w), whose length does not matter."""
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


def _primitive(tree: Tree, binary: bytes, primitive: Tree, left: int) -> tuple[Indices, Array]:
    """Read the triangles (t, 3) of one primitive of a mesh, and the vertices (n, 3) that they use.

    Args:
        tree: The JSON chunk.
        binary: The binary chunk.
        primitive: The primitive's entry in the JSON chunk.
        left: How many more triangles are allowed.
    """
    mode = primitive.get("mode", TRIANGLES)
    if "targets" in primitive or primitive.get("extensions"):
        unsupported("a primitive has morph targets or extensions", "export plain triangles")
    if mode not in (TRIANGLES, STRIP):
        unsupported(f"a primitive has mode {shown(mode)}, not triangles", "export triangles only")
    points = _stored(tree, binary, primitive["attributes"]["POSITION"], "VEC3")
    order = (
        _stored(tree, binary, primitive["indices"], "SCALAR") if "indices" in primitive else None
    )
    corners = points.count if order is None else order.count
    triangles = corners - 2 if mode == STRIP else corners // CORNERS
    if triangles > left:
        too_many(triangles, left)
    flat = np.arange(corners) if order is None else order.rows(slice(None)).ravel().astype(np.int64)
    if mode == STRIP:
        rows = np.stack([flat[:-2], flat[1:-1], flat[2:]], axis=1)
        # every other triangle of a strip is wound the other way
        rows[1::2] = rows[1::2, [1, 0, 2]]
    elif len(flat) % CORNERS:
        broken("a primitive", f"{len(flat)} corners are not a multiple of three")
    else:
        rows = flat.reshape(-1, 3)
    if rows.size and rows.max() >= points.count:
        wrong = int(rows.max())
        outside(f"triangle {np.argwhere(rows == wrong)[0, 0]}", wrong, points.count)
    used, rows = np.unique(rows, return_inverse=True)
    return rows.reshape(-1, 3), points.rows(used).astype(np.float64)


@dataclass(frozen=True, slots=True)
class _Stored:
    """The numbers of one accessor as raw bytes, converted only when `rows` is called."""

    raw: NDArray[np.uint8]
    """Bytes of each row, (number of rows, bytes per row)."""
    item: "np.dtype[Any]"

    @property
    def count(self) -> int:
        return len(self.raw)

    def rows(self, which: "slice | Indices") -> "NDArray[Any]":
        """Convert the selected rows to numbers, (n, numbers per row)."""
        return np.ascontiguousarray(self.raw[which]).view(self.item)


def _stored(tree: Tree, binary: bytes, number: int, shape: str) -> _Stored:
    """Find the numbers of a glTF accessor in the binary chunk, one row per element."""
    _check_place(number, tree["accessors"])
    accessor = tree["accessors"][number]
    kind = accessor["componentType"]
    wanted = {FLOAT_TYPE: "<f4"} if shape == "VEC3" else INDEX_TYPES
    if accessor["type"] != shape or kind not in wanted or accessor.get("normalized"):
        unsupported(
            f"accessor {number} has type {shown(accessor['type'])} of component {shown(kind)}",
            "export plain triangles",
        )
    if "sparse" in accessor or "bufferView" not in accessor:
        unsupported(f"accessor {number} is sparse or without data", "export plain triangles")
    _check_place(accessor["bufferView"], tree["bufferViews"])
    view = tree["bufferViews"][accessor["bufferView"]]
    _check_place(view["buffer"], tree["buffers"])
    item = np.dtype(wanted[kind])
    row = item.itemsize * (CORNERS if shape == "VEC3" else 1)
    stride, count = view.get("byteStride", row), accessor["count"]
    inside, start = accessor.get("byteOffset", 0), view.get("byteOffset", 0)
    sizes = (stride, inside, start, count, view["byteLength"])
    if any(type(size) is not int or size < 0 for size in sizes) or stride < row:
        broken(
            f"accessor {number}",
            f"sizes must be whole numbers from 0 on, byteStride at least {row}",
        )
    length = (count - 1) * stride + row if count else 0
    if inside + length > view["byteLength"] or start + view["byteLength"] > len(binary):
        broken(
            f"accessor {number}",
            f"{count} elements do not fit into the binary chunk of {len(binary)} bytes",
        )
    raw = np.frombuffer(binary, dtype=np.uint8)[start + inside :]
    rows = np.lib.stride_tricks.as_strided(raw, (count, row), (stride, 1), writeable=False)
    return _Stored(rows, item)
