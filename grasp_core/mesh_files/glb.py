"""Reads GLB files (binary glTF): trimesh decodes meshes, and the poses of nodes in their parents.

The pose of a mesh is the product of the matrices from the root of its scene down to its node. Where
this matrix mirrors, the triangles are wound the other way, so that normals still point outwards.
trimesh passes over what it does not read, and trusts the numbers of a file. So features that would
change the shape (compression, sparse accessors, skins, morph targets, external files, meshes under
a camera) and numbers that would make a small file huge are refused first.
"""

import importlib
import io
import json
import struct
from typing import Any

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.errors import MeshError, MeshRefusal
from grasp_core.mesh_files.polygons import check_corners, too_many, unsupported

GLB_HEAD = "<4sIIII"
JSON_CHUNK = 0x4E4F534A
MOST_NODES = 10_000
MOST_VALUES = 4_000_000
"""Largest number of JSON values allowed: each of them takes up to a quarter of a kilobyte."""
MOST_SHARED = 4
"""Largest number of times, on average, that views and accessors may use each byte of a file."""
PLAIN_PREFIXES = ("KHR_materials", "KHR_texture", "KHR_lights", "EXT_texture", "KHR_xmp")
"""Prefixes of glTF extensions that change only the appearance; files with others are refused."""
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
INDEX_TYPES, FLOAT_TYPE = (5121, 5123, 5125), 5126
TRIANGLES, STRIP = 4, 5
MODES = {TRIANGLES, STRIP}
NODE_REFERENCES = {"mesh", "children"}
POSE_PARTS = {"translation": 3, "rotation": 4, "scale": 3}
JsonObject = dict[str, Any]
"""A JSON object of a glTF file, whose values are checked where they are used."""


def read_glb(data: bytes, most: int) -> tuple[Array, Indices]:
    """Read the vertices (n, 3) and triangles (t, 3) of a GLB file's default scene."""
    try:
        tree = _tree(data)
        _check_features(tree)
        _check_sizes(tree, len(data), most)
        with np.errstate(over="ignore", invalid="ignore"):  # what is not finite is refused
            return _scene(data, most)
    except (MeshError, MemoryError):
        raise
    except Exception as error:  # trimesh raises whatever the numbers of the file lead it to
        raise ValueError(f"{type(error).__name__}: {error}") from error


def _tree(data: bytes) -> JsonObject:
    _, version, length, size, chunk = struct.unpack_from(GLB_HEAD, data)
    start = struct.calcsize(GLB_HEAD)
    if version != 2 or length != len(data) or chunk != JSON_CHUNK:  # noqa: PLR2004
        raise ValueError(f"expected glTF 2 of {len(data)} bytes, JSON first; got {length} bytes")
    text = data[start : start + size]
    if sum(map(text.count, (b",", b"[", b"{"))) > MOST_VALUES:
        message = f"the JSON part has over {MOST_VALUES} values, the limit; simplify the mesh"
        raise MeshError(MeshRefusal.TOO_MANY, message)
    return json.loads(text.decode("utf-8"))


def _check_features(tree: JsonObject) -> None:
    """Refuse features that would change the shape and are not read."""
    buffers, nodes, accessors = (tree.get(name, []) for name in ("buffers", "nodes", "accessors"))
    parts = [part for mesh in tree.get("meshes", []) for part in mesh["primitives"]]
    names = map(str, (*tree.get("extensionsRequired", ()), *tree.get("extensionsUsed", ())))
    wrong = {
        "numbers outside the binary chunk": len(buffers) > 1 or any("uri" in b for b in buffers),
        "compression": not all(name.startswith(PLAIN_PREFIXES) for name in names),
        "a skin or weights of morph targets": any({"skin", "weights"} & n.keys() for n in nodes),
        "a camera with meshes": any("camera" in n and NODE_REFERENCES & n.keys() for n in nodes),
        "morph targets or extensions": any("targets" in p or p.get("extensions") for p in parts),
        "lines, points or fans": not {part.get("mode", TRIANGLES) for part in parts} <= MODES,
        "sparse numbers": any("sparse" in a or "bufferView" not in a for a in accessors),
    }
    for feature in (name for name, there in wrong.items() if there):
        unsupported(feature, "export plain triangles")
    for node in nodes:
        _check_pose(node)
    for part in parts:
        points = _item(accessors, part["attributes"]["POSITION"])
        if (points["componentType"], points["type"]) != (FLOAT_TYPE, "VEC3"):
            raise ValueError("positions must be three numbers of single precision")
        corners = _item(accessors, part["indices"]) if "indices" in part else None
        if corners and (corners["componentType"] not in INDEX_TYPES or corners["type"] != "SCALAR"):
            raise ValueError("indices must be whole numbers without a sign")


def _check_sizes(tree: JsonObject, size: int, most: int) -> None:
    """Refuse numbers that would make trimesh reserve more memory than the file accounts for."""
    views, meshes, nodes = (tree.get(name, []) for name in ("bufferViews", "meshes", "nodes"))
    used = sum(_whole(view["byteLength"]) for view in views)
    for accessor in tree.get("accessors", []):
        _item(views, accessor["bufferView"])
        used += _whole(accessor["count"]) * WIDTHS[accessor["type"]]
    if used > MOST_SHARED * size:
        raise ValueError(f"a file of {size} bytes announces {used} bytes and numbers")
    placed = [_item(meshes, node["mesh"]) for node in nodes if "mesh" in node]
    parts = max(sum(len(mesh["primitives"]) for mesh in each) for each in (placed, meshes))
    if parts > most:
        too_many(parts, most)
    below = [*_roots(tree), *(child for node in nodes for child in node.get("children", []))]
    if len(set(below)) < len(below) or len(nodes) > MOST_NODES:
        raise ValueError(f"nodes must form a tree of at most {MOST_NODES} nodes")


def _check_pose(node: JsonObject) -> None:
    """Refuse a pose that trimesh would read as another one."""
    if "matrix" in node:
        columns = _numbers(node["matrix"], 16)[3::4]  # glTF lists matrices by columns
        if POSE_PARTS.keys() & node.keys() or columns.tolist() != [0.0, 0.0, 0.0, 1.0]:
            raise ValueError("a node has a matrix of perspective, or a rotation beside its matrix")
    given = {
        name: _numbers(node[name], count) for name, count in POSE_PARTS.items() if name in node
    }
    size = float(np.linalg.norm(given.get("rotation", 1.0)))
    if not 0.5 < size < 2.0:  # noqa: PLR2004 - rounding does not get there
        raise ValueError(f"a rotation is a quaternion of length {size:.3g}, expected 1")


def _scene(data: bytes, most: int) -> tuple[Array, Indices]:
    """Decode all parts of meshes, and place them by the nodes of the default scene."""
    gltf: Any = importlib.import_module("trimesh.exchange.gltf")

    found = gltf.load_glb(io.BytesIO(data), skip_materials=True)
    points, triangles = [np.empty((0, 3))], [np.empty((0, 3), dtype=np.int64)]
    poses = {found["base_frame"]: np.eye(4)}
    before = placed = 0
    for node in found["graph"]:  # those above come first
        pose = poses[node["frame_to"]] = poses[node["frame_from"]] @ node["matrix"]
        if "geometry" not in node:
            continue
        held = found["geometry"][node["geometry"]]
        rows = np.array(held["faces"], dtype=np.int64)
        placed += max(len(rows), 1)
        if placed > most:
            too_many(placed, most)
        check_corners(rows, len(held["vertices"]))
        used, rows = np.unique(rows, return_inverse=True)
        rows = before + rows.reshape(-1, 3)
        local = np.asarray(held["vertices"])[used].astype(np.float64)
        points.append(local @ pose[:3, :3].T + pose[:3, 3])
        mirrored = np.linalg.det(pose[:3, :3]) < 0.0
        triangles.append(rows[:, ::-1] if mirrored else rows)
        before += len(used)
    return np.vstack(points), np.vstack(triangles)


def _numbers(given: list[Any], count: int) -> Array:
    if len(given) != count or any(type(each) not in (int, float) for each in given):
        raise ValueError(f"a node's matrix or vector must be {count} numbers")
    return np.array(given, dtype=np.float64)


def _roots(tree: JsonObject) -> list[int]:
    scenes = tree.get("scenes")
    return _item(scenes, tree.get("scene", 0)).get("nodes", []) if scenes else []


def _item(listed: list[JsonObject], place: object) -> JsonObject:
    if type(place) is not int or not 0 <= place < len(listed):
        raise ValueError(f"it refers to item {str(place)[:40]} of a list of {len(listed)}")
    return listed[place]


def _whole(size: object) -> int:
    if type(size) is not int or size < 0:
        raise ValueError(f"sizes must be whole numbers from 0 on, got {str(size)[:40]}")
    return size
