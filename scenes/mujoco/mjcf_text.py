"""Writes MJCF elements, with numbers in full precision and names that can be printed.

Elements are written here, one per line, because scenes have many short ones: `xml.etree` takes
several times as long for the same text.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from xml.sax.saxutils import escape

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.declared import ByValue
from grasp_core.solvers.ties import first_best

COMPILER = {"angle": "radian", "autolimits": "false", "inertiafromgeom": "false"}
QUOTE = {'"': "&quot;"}
"""What stands for the sign that ends an attribute."""
MANY = 50
"""Size of an array above which its text is kept for the next scene."""


def quaternion(rotation: Array) -> Array:
    """Convert a rotation matrix to a unit quaternion (w, x, y, z), its largest part positive.

    The rows below are 4 q_i q for each component q_i of the quaternion q; the row of the largest
    component has the most accurate digits.
    """
    (a, b, c), (d, e, f), (g, h, i) = rotation.tolist()
    rows = np.array(
        [
            [1.0 + a + e + i, h - f, c - g, d - b],
            [h - f, 1.0 + a - e - i, b + d, c + g],
            [c - g, b + d, 1.0 - a + e - i, f + h],
            [d - b, c + g, f + h, 1.0 - a - e + i],
        ]
    )
    row = rows[first_best(np.diag(rows))]
    return row / math.sqrt(sum(part * part for part in row.tolist()))


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class SceneText(ByValue):
    """The text of a MuJoCo model: what scenes of every kind are."""

    xml: str


@dataclass(frozen=True, slots=True, eq=False)
class Element:
    """An element of a scene, or a comment, to which further elements can be added."""

    tag: str
    text: str
    """Its attributes as they are written, each after a blank; or the text of a comment."""
    inside: "list[Element]" = field(default_factory=list["Element"])


def element(tag: str, attributes: Mapping[str, object]) -> Element:
    """Make an element with attributes of any plain kind."""
    parts = [f' {name}="{text}"' for name, text in as_texts(attributes).items()]
    return Element(tag, "".join(parts))


def add_element(parent: Element, tag: str, attributes: Mapping[str, object]) -> Element:
    """Add an element with attributes of any plain kind."""
    added = element(tag, attributes)
    parent.inside.append(added)
    return added


def add_comment(parent: Element, text: str) -> None:
    """Add a comment for people who read the file; MuJoCo does not read it."""
    parent.inside.append(Element("", text.replace("--", "- -")))  # XML ends comments with `--`


def document(root: Element) -> str:
    """Write an element and all that is inside it as the text of a file."""
    return "\n".join([*_lines(root, ""), ""])


def _lines(own: Element, margin: str) -> Iterator[str]:
    if not own.tag:
        yield f"{margin}<!-- {own.text} -->"
    elif not own.inside:
        yield f"{margin}<{own.tag}{own.text} />"
    else:
        yield f"{margin}<{own.tag}{own.text}>"
        for each in own.inside:
            yield from _lines(each, margin + "  ")
        yield f"{margin}</{own.tag}>"


def as_texts(attributes: Mapping[str, object]) -> dict[str, str]:
    """Write the values of attributes, which may be those of several elements."""
    return {name: as_text(value) for name, value in attributes.items()}


def as_text(value: object) -> str:
    """Write a number in full precision, a sequence of them separated by blanks, or words."""
    if isinstance(value, str):
        return value if value.isalnum() else escape(value, QUOTE)
    if type(value) in (float, int):  # the most frequent ones, and an array would take longer
        return repr(value)
    numbers: Array | Indices = np.asarray(value)
    if numbers.size > MANY:
        return _many(numbers.tobytes(), numbers.dtype.str)
    return _separated(numbers)


@lru_cache(maxsize=8)
def _many(numbers: bytes, kind: str) -> str:
    """Write many numbers; an object's mesh is the same in all scenes of its grasps."""
    return _separated(np.frombuffer(numbers, kind))


def _separated(numbers: Array | Indices) -> str:
    return " ".join(map(repr, numbers.ravel().tolist()))


def printable(name: str) -> str:
    """Replace the characters of a model's name that cannot be printed."""
    return "".join(c if c.isprintable() else "_" for c in name) or "object"
