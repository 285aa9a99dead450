"""Reads the header of a PLY file: which tables ("elements") follow, and the columns of each."""

import re
from dataclasses import dataclass, field

from grasp_core.mesh_files.refusals import broken, shown
from grasp_core.mesh_files.words import whole

TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4",
    "float": "f4", "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2",
    "int32": "i4", "uint32": "u4", "int64": "i8", "uint64": "u8",
    "float16": "f2", "float32": "f4", "float64": "f8",
}  # fmt: skip
ORDERS = {"ascii": "=", "binary_little_endian": "<", "binary_big_endian": ">"}
END = re.compile(rb"\n[ \t]*end_header[ \t]*\r?\n|\r[ \t]*end_header[ \t]*\r")
LONGEST_HEADER = 2**16
NAME = re.compile(r"[!-~\ufffd]{1,100}")
LISTS = ("vertex_indices", "vertex_index")
POINT = ("x", "y", "z")


@dataclass(frozen=True, slots=True)
class Property:
    """A column of a PLY table: one number, or one list of numbers, in each row."""

    name: str
    kind: str
    """The number type as numpy writes it, without the byte order, such as `f4`."""
    count_kind: str | None = None
    """The number type of a list's length; None if the column holds single numbers."""


@dataclass(frozen=True, slots=True)
class Element:
    """A table that the header of a PLY file announces, such as `vertex` or `face`."""

    name: str
    rows: int
    properties: list[Property] = field(default_factory=list[Property])

    def place(self, names: tuple[str, ...]) -> Property:
        """Find the one property whose name is among `names`."""
        found = [each for each in self.properties if each.name in names]
        if len(found) != 1:
            broken("the header", f"element {self.name} needs one property {' or '.join(names)}")
        return found[0]

    @property
    def kept(self) -> tuple[str, ...]:
        """Return the names of the properties that describe the surface."""
        return {"vertex": POINT, "face": LISTS}.get(self.name, ())

    @property
    def lists(self) -> bool:
        """Return whether any property is a list, so that rows may differ in length."""
        return any(each.count_kind is not None for each in self.properties)


@dataclass(frozen=True, slots=True)
class Header:
    """The tables of a PLY file, and the byte where the header ends."""

    order: str
    """Byte order of the numbers, `<` or `>`, or `=` for a text file."""
    elements: list[Element]
    end: int


def read_header(data: bytes) -> Header:
    """Read the header of a PLY file."""
    found = END.search(data[:LONGEST_HEADER])
    if not found:
        broken("the header", "expected `end_header`")
    order, elements = _lines(data[: found.start()])
    if not order:
        broken("the header", "expected a line such as `format ascii 1.0`")
    for element in elements:
        _check_element(element)
    tables = {each.name: each for each in elements}
    if len(tables) < len(elements) or not {"vertex", "face"} <= tables.keys():
        broken(
            "the header", f"expected elements vertex and face, once each, got {shown(list(tables))}"
        )
    _check_properties(tables["vertex"], tables["face"])
    return Header(order, elements, found.end())


def _lines(text: bytes) -> tuple[str, list[Element]]:
    first, *lines = [line.split() for line in text.decode("ascii", "replace").splitlines()]
    order, elements = "", list[Element]()
    if [word.lower() for word in first] != ["ply"]:
        broken("the header", "expected the first line `ply`")
    for number, words in enumerate(lines, 2):
        where = f"header line {number}"
        match words:
            case ["comment" | "obj_info", *_] | []:
                pass
            case ["format", name, "1.0"] if name in ORDERS and not order:
                order = ORDERS[name]
            case ["element", name, rows]:
                elements.append(Element(name, whole(rows.encode(), where)))
            case ["property", first, *others] if elements:
                elements[-1].properties.append(_property([first, *others], where))
            case _:
                broken(
                    where, f"expected format, element or property, got {shown(' '.join(words))!r}"
                )
    return order, elements


def _check_properties(vertex: Element, face: Element) -> None:
    for name in POINT:
        if vertex.place((name,)).count_kind is not None:
            broken("the header", f"property {name} must be a number, not a list")
    if face.place(LISTS).count_kind is None:
        broken("the header", "the corners of faces must be a list")


def _check_element(element: Element) -> None:
    names = [element.name, *(each.name for each in element.properties)]
    if not all(NAME.fullmatch(name) for name in names) or len(names[1:]) > len(set(names[1:])):
        broken("the header", "names must be words of at most 100 letters, and must not repeat")
    if element.rows < 0 or (element.rows and not element.properties):
        broken("the header", f"element {element.name} needs properties and a count from 0 on")


def _property(said: list[str], where: str) -> Property:
    lists = said[0] == "list"
    kinds = said[1:-1] if lists else said[:-1]
    if len(kinds) != 1 + lists or not TYPES.keys() >= set(kinds):
        broken(where, f"expected `TYPE NAME` or a list, got {shown(' '.join(said))!r}")
    if lists and TYPES[kinds[0]].startswith("f"):
        broken(where, "the length of a list must be a whole number")
    return Property(said[-1], TYPES[kinds[-1]], TYPES[kinds[0]] if lists else None)
