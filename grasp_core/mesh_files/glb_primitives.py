"""One primitive of a glTF mesh: its triangles and vertices are decoded from the binary chunk."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array, Indices
from grasp_core.mesh_files.polygon_soup import CORNERS, too_many
from grasp_core.mesh_files.refusals import broken, outside, shown, unsupported

INDEX_TYPES = {5121: "<u1", 5123: "<u2", 5125: "<u4"}
FLOAT_TYPE = 5126
TRIANGLES, STRIP = 4, 5
Tree = dict[str, Any]
"""A JSON object of a glTF file, whose values are checked where they are used."""


def decoded_primitive(
    tree: Tree, binary: bytes, primitive: Tree, left: int
) -> tuple[Indices, Array]:
    """Read the triangles (t, 3) of one primitive of a mesh, and their vertices (n, 3)."""
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
    check_place(number, tree["accessors"])
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
    check_place(accessor["bufferView"], tree["bufferViews"])
    view = tree["bufferViews"][accessor["bufferView"]]
    check_place(view["buffer"], tree["buffers"])
    item = np.dtype(wanted[kind])
    row = item.itemsize * (CORNERS if shape == "VEC3" else 1)
    stride, count = view.get("byteStride", row), accessor["count"]
    inside, start = accessor.get("byteOffset", 0), view.get("byteOffset", 0)
    sizes = (stride, inside, start, count, view["byteLength"])
    if any(type(size) is not int or size < 0 for size in sizes) or stride < row:
        broken(
            f"accessor {number}",
            f"sizes must be whole numbers from 0 on, and byteStride at least {row}",
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


def check_place(place: object, listed: list[Any]) -> None:
    """Refuse a reference that is not the index of an item in a list of the JSON chunk."""
    if type(place) is not int or not 0 <= place < len(listed):
        broken("the JSON part", f"it refers to item {shown(place)} of a list of {len(listed)}")
