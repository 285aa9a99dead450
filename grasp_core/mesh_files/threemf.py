"""Reads 3MF files: the objects of the model in a zip archive, placed by the items of its build.

The model is XML. An object is a mesh, or consists of components, which are other objects with
poses; an item of the build is an object with a pose. A pose is four rows of three numbers, by which
a point and a 1 are multiplied from the left. Where it mirrors, the triangles are wound the other
way, so that normals still point outwards.

trimesh reads 3MF, too, but without a word it loses one of two items with equal part numbers and
most of many nested components, takes supports for solids, and every mesh of another file for the
one that is asked for. Expat, which reads the XML here, is a part of Python and keeps no tree.

Elements and attributes that would change the shape and are not read are refused. The model and the
settings of slicers may together take as many bytes as a mesh file, and a token of XML as many as
`LONGEST_TOKEN`. Document types are refused, so no entity is ever expanded.
"""

import io
import re
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import IO, NamedTuple, TypeAlias
from xml.parsers import expat

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.errors import MeshError, MeshRefusal
from grasp_core.mesh_files.limits import LengthUnit
from grasp_core.mesh_files.polygons import Polygons, TextPoints, too_many, unsupported, whole

CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
PLAIN_NAMESPACES = {
    CORE,
    "http://schemas.microsoft.com/3dmanufacturing/trianglesets/2021/07",
    "http://schemas.microsoft.com/3dmanufacturing/material/2015/02",
    "http://schemas.microsoft.com/3dmanufacturing/production/2015/06",
}
"""Extensions that a model may require: they change the appearance, or only name things. That of
production may also refer to objects in other files, which is refused where it does."""
TRIANGLE_SETS = "http://schemas.microsoft.com/3dmanufacturing/trianglesets/2021/07 trianglesets"
"""The one element in a mesh that is passed over."""
MODEL_UNITS: dict[str, LengthUnit] = {
    "micron": "um", "millimeter": "mm", "centimeter": "cm", "meter": "m", "inch": "in", "foot": "ft"
}  # fmt: skip
USUAL_UNIT = "millimeter"
PARENTS = {
    "model": ("",), "resources": ("model",), "build": ("model",), "item": ("build",),
    "object": ("resources",), "components": ("object",), "component": ("components",),
    "mesh": ("object",), "vertices": ("mesh",), "vertex": ("vertices",), "triangles": ("mesh",),
    "triangle": ("triangles",), "basematerials": ("resources",), "base": ("basematerials",),
    "metadatagroup": ("object", "item"), "metadata": ("model", "metadatagroup"),
}  # fmt: skip
"""Elements of the core, each with those that it may stand in."""
SHAPING = {"object", "components", "component", "mesh", "vertices", "triangles", "build", "item"}
"""Elements in which one of an extension would change the shape."""
FOREIGN = "of an extension"
DEEPEST_ELEMENT, MOST_ITEMS = 64, 10_000
"""Largest depth of elements, and largest number of objects, components and items."""
MODEL, RELATIONS = "3d/3dmodel.model", "_rels/.rels"
"""Usual name of the model, and that of the part that names it, in small letters."""
IS_MODEL = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"
BEGINNING, LISTED, MOST_PARTS = b"PK\3\4", b"PK\1\2", 10_000
MOST_RELATIONS, BYTES_AT_ONCE, LONGEST_TOKEN = 2**20, 2**16, 2**20
"""Largest number of bytes of the relations, of XML that is read at once, and of one token."""
PACKED, ENCRYPTED = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED), 1
NOT_SOLID = re.compile(
    rb'"volume_type"\s+value="(?!ModelPart")|"modifier"\s+value="1"|\ssubtype="(?!normal_part")'
)
"""Settings of slicers that make a part of a mesh a hole, a support, or a region of other settings.
"""
SLICER_SETTINGS = re.compile(r"metadata/[^/]*model[^/]*\.config")
"""Names of the parts in which slicers keep them."""
Attributes: TypeAlias = dict[str, str]
Start: TypeAlias = Callable[[str, Attributes], object]
PosedObject: TypeAlias = tuple[int, Array]
"""The number of an object and its pose, (4, 4)."""


class BuiltSurface(NamedTuple):
    """The surface that a model builds, in its unit of length."""

    vertices: Array
    triangles: Indices
    rounding: float
    unit: LengthUnit


def read_3mf(data: bytes, most: int, room: int) -> BuiltSurface:
    """Read what a 3MF file builds; its model may have as many bytes as there is room."""
    try:
        model = ModelPart(most)
        with zipfile.ZipFile(io.BytesIO(_checked(data))) as archive:
            parts = _parts(archive)
            settings = [part for name, part in parts.items() if SLICER_SETTINGS.fullmatch(name)]
            part = _model_part(archive, parts)
            _check_sizes([part, *settings], room)
            for each in settings:
                with _opened(archive, each) as stream:
                    if NOT_SOLID.search(stream.read(room)):
                        unsupported("a modifier, support or negative volume", "export solids only")
            with _opened(archive, part) as stream:
                _parse(stream, model.start, model.end, model.prefix)
        with np.errstate(over="ignore", invalid="ignore"):  # what is not finite is refused
            return model.built()
    except (MeshError, MemoryError):
        raise
    except Exception as error:  # a damaged archive leads zipfile to raise anything
        missing = "the attribute is missing: " if isinstance(error, KeyError) else ""
        raise ValueError(f"{missing}{error or type(error).__name__}") from error


def _checked(data: bytes) -> bytes:
    if not data.startswith(BEGINNING):
        raise ValueError("expected a zip archive")
    if data.count(LISTED) > MOST_PARTS:
        raise ValueError(f"the archive has over {MOST_PARTS} parts")
    return data


def _parts(archive: zipfile.ZipFile) -> dict[str, zipfile.ZipInfo]:
    """Return the parts by name, in which case does not count."""
    listed = archive.infolist()
    parts = {each.filename.lower(): each for each in listed}
    if len(parts) < len(listed):
        raise ValueError("two parts of the archive have the same name")
    return parts


def _check_sizes(parts: list[zipfile.ZipInfo], room: int) -> None:
    size = sum(part.file_size for part in parts)
    if size > room:
        message = (
            f"the model takes {size} bytes when it is unpacked, over the limit of {room}; simplify "
            "the mesh, or allow more (--max-mesh-bytes, and perhaps --max-triangles)"
        )
        raise MeshError(MeshRefusal.TOO_MANY, message)


def _opened(archive: zipfile.ZipFile, part: zipfile.ZipInfo) -> IO[bytes]:
    """Open a part, of which no more bytes can be read than it announces."""
    if part.compress_type not in PACKED or part.flag_bits & ENCRYPTED:
        raise ValueError("a part is encrypted, or compressed otherwise than by deflate")
    return archive.open(part)


def _model_part(archive: zipfile.ZipFile, parts: dict[str, zipfile.ZipInfo]) -> zipfile.ZipInfo:
    """Return the part that the relations of the archive call its model, or the usual one."""
    found = list[str]()

    def start(_: str, attributes: Attributes) -> None:
        if attributes.get("Type") == IS_MODEL:
            found.append(attributes["Target"])

    if RELATIONS in parts:
        if parts[RELATIONS].file_size > MOST_RELATIONS:
            raise ValueError(f"the relations take over {MOST_RELATIONS} bytes")
        with _opened(archive, parts[RELATIONS]) as stream:
            _parse(stream, start)
        if len(found) != 1:
            raise ValueError(f"expected one relation to a model, got {len(found)}")
    name = found[0].removeprefix("/").lower() if found else MODEL
    if name not in parts:
        raise ValueError(f"no part is named {name[:40]}, which must be the model")
    return parts[name]


def _parse(
    stream: IO[bytes], start: Start, end: Callable[[str], object] | None = None,
    prefix: Callable[[str | None, str | None], object] | None = None,
) -> None:  # fmt: skip
    """Read XML piece by piece."""
    parser = expat.ParserCreate(namespace_separator=" ")
    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.StartNamespaceDeclHandler = prefix
    parser.StartDoctypeDeclHandler = _refuse_document_type
    read = 0
    while piece := stream.read(BYTES_AT_ONCE):
        parser.Parse(piece, False)
        read += len(piece)
        if read - parser.CurrentByteIndex > LONGEST_TOKEN:
            raise ValueError(f"a tag or a comment is longer than {LONGEST_TOKEN} bytes")
    parser.Parse(b"", True)


def _refuse_document_type(*_: object) -> None:
    raise ValueError("the XML has a document type, which 3MF forbids")


@dataclass(slots=True)
class ModelObject:
    """One object: a mesh, or components."""

    kind: str
    """Type of the object, which is `model` for solids."""
    points: TextPoints
    polygons: Polygons
    components: list[PosedObject] = field(default_factory=list[PosedObject])

    def surface(self) -> tuple[Array, Indices, float]:
        """Return the vertices that triangles use, the triangles, and the coordinates' rounding."""
        corners = self.polygons.fans(self.points.array)
        used, rows = np.unique(corners, return_inverse=True)
        return self.points.array[used], rows.reshape(-1, 3), self.points.rounding


class ModelPart:
    """Takes the elements of a model as they are read."""

    def __init__(self, most: int) -> None:
        self.most = most
        self.unit: LengthUnit = MODEL_UNITS[USUAL_UNIT]
        self.solids, self.items = dict[int, ModelObject](), list[PosedObject]()
        self.latest = ModelObject(
            "", TextPoints(), Polygons(most)
        )  # takes the tables that are read
        self.seen, self.path = set[str](), [""]  # elements of the object, and those that are open
        self.prefixes = dict[str | None, str | None]()
        self.triangles = self.nodes = 0
        self.takers: dict[str, Callable[[Attributes], None]] = {
            "vertex": self.vertex, "triangle": self.triangle, "component": self.component,
            "item": self.item, "object": self.object, "model": self.model,
        }  # fmt: skip

    def prefix(self, name: str | None, extension: str | None) -> None:
        """Take the name of an extension."""
        self.prefixes.setdefault(name, extension)

    def start(self, name: str, attributes: Attributes) -> None:
        """Take the start of an element."""
        extension, _, word = name.rpartition(" ")
        above = self.path[-1]
        own = word if extension == CORE and above != FOREIGN else FOREIGN
        if own == FOREIGN and above in SHAPING and name != TRIANGLE_SETS:
            unsupported(f"<{word[:40]}> of an extension", "export plain triangles")
        if not above if own == FOREIGN else above not in PARENTS.get(own, ()):
            raise ValueError(f"<{word[:40]}> in {above or 'place of a 3MF model'}")
        if own in {"mesh", "components", "vertices", "triangles"}:
            other = {"mesh": "components", "components": "mesh"}.get(own)
            if own in self.seen or other in self.seen:
                raise ValueError("an object has two meshes or tables, or components beside a mesh")
            self.seen.add(own)
        self.path.append(own)
        if len(self.path) > DEEPEST_ELEMENT:
            raise ValueError(f"elements are nested more than {DEEPEST_ELEMENT} deep")
        if own in self.takers:
            self.takers[own](attributes)

    def end(self, _: str) -> None:
        """Take the end of an element."""
        if self.path.pop() == "object" and not {"mesh", "components"} & self.seen:
            raise ValueError("an object has neither a mesh nor components")

    def model(self, attributes: Attributes) -> None:
        """Take the unit and the extensions that the model requires."""
        unit = attributes.get("unit", USUAL_UNIT)
        if unit not in MODEL_UNITS:
            raise ValueError(f"the unit must be one of {', '.join(MODEL_UNITS)}, got {unit[:20]}")
        self.unit = MODEL_UNITS[unit]
        for prefix in attributes.get("requiredextensions", "").split():
            if self.prefixes.get(prefix) not in PLAIN_NAMESPACES:
                said = f"the extension {self.prefixes.get(prefix, prefix)!a:.80}"
                unsupported(said, "export plain triangles")

    def object(self, attributes: Attributes) -> None:
        """Take the start of an object."""
        self._count_node()
        number = whole(_word(attributes["id"]))
        if number in self.solids:
            raise ValueError(f"two objects have the number {number}")
        if any(name.endswith(" slicestackid") for name in attributes):  # the mesh may be a box
            unsupported("an object of slices", "export plain triangles")
        self.seen.clear()
        kind = attributes.get("type", "model")
        self.latest = self.solids[number] = ModelObject(kind, TextPoints(), Polygons(self.most))

    def vertex(self, attributes: Attributes) -> None:
        """Take a vertex of the object."""
        self.latest.points.add([_word(attributes[axis]) for axis in ("x", "y", "z")])

    def triangle(self, attributes: Attributes) -> None:
        """Take a triangle of the object."""
        self.triangles += 1
        if self.triangles > self.most:
            too_many(self.triangles, self.most)
        self.latest.polygons.add([whole(_word(attributes[at])) for at in ("v1", "v2", "v3")])

    def component(self, attributes: Attributes) -> None:
        """Take a component of the object."""
        self._count_node()
        self.latest.components.append(_placed(attributes))

    def item(self, attributes: Attributes) -> None:
        """Take an item of the build."""
        if attributes.get("printable", "1") != "1":
            unsupported("an item that is not to be printed", "export what is to be grasped")
        self._count_node()
        self.items.append(_placed(attributes))

    def _count_node(self) -> None:
        self.nodes += 1
        if self.nodes > MOST_ITEMS:
            raise ValueError(f"it has over {MOST_ITEMS} objects, components and items")

    def built(self) -> BuiltSurface:
        """Place the objects that the build names."""
        points, triangles = [np.empty((0, 3))], [np.empty((0, 3), dtype=np.int64)]
        surfaces = dict[int, tuple[Array, Indices, float]]()
        before, rounding = 0, 0.0
        for number, pose in self._meshes():
            if number not in surfaces:
                surfaces[number] = self.solids[number].surface()
            local, rows, off_by = surfaces[number]
            turn = pose[:3, :3]
            points.append(local @ turn + pose[3, :3])
            triangles.append(before + (rows[:, ::-1] if np.linalg.det(turn) < 0.0 else rows))
            rounding = max(rounding, off_by * float(np.abs(turn).sum(axis=0).max()))
            before += len(local)
        return BuiltSurface(np.vstack(points), np.vstack(triangles), rounding, self.unit)

    def _meshes(self) -> Iterator[PosedObject]:
        """Yield the meshes of the build with their poses, in the order of the file."""
        ahead, placed = [(*item, 1) for item in reversed(self.items)], 0
        while ahead:
            number, pose, depth = ahead.pop()
            if number not in self.solids:
                raise ValueError(f"it places object {number}, which it does not hold")
            solid = self.solids[number]
            if solid.kind != "model":
                unsupported(f"an object of type {solid.kind!a:.40}", "export solids only")
            if depth > len(self.solids):
                raise ValueError(f"object {number} is a component of itself")
            placed += max(solid.polygons.triangles, 1)
            if placed > self.most:
                too_many(placed, self.most)
            if solid.polygons.triangles:
                yield number, pose
            for part, within in reversed(solid.components):
                ahead.append((part, within @ pose, depth + 1))


def _placed(attributes: Attributes) -> PosedObject:
    """Return the object that a component or an item names, and its pose."""
    if any(name.endswith(" path") for name in attributes):
        unsupported("an object in another file of the archive", "export it without splitting it up")
    pose = np.eye(4)
    if "transform" in attributes:
        words, rows = attributes["transform"].split(), TextPoints()
        if len(words) != pose[:, :3].size:
            raise ValueError(f"a transform needs twelve numbers, got {len(words)}")
        for first in range(0, len(words), 3):
            rows.add([_word(word) for word in words[first : first + 3]])
        pose[:, :3] = rows.array
    return whole(_word(attributes["objectid"])), pose


def _word(text: str) -> bytes:
    """Return the value of an attribute; letters that no number has become `?`."""
    return text.encode("ascii", "replace")
