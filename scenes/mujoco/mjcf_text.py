"""Writes MJCF elements, with numbers in full precision and names that can be printed.

Elements are written here, one per line, because scenes have many short ones: `xml.etree` takes
several times as long for the same text.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TypeAlias

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.by_value import ByValue
from grasp_core.solvers.ties import first_best

COMPILER = {"angle": "radian", "autolimits": "false", "inertiafromgeom": "false"}
ESCAPED = str.maketrans({"&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;"})
"""What stands in attributes for signs that have a meaning in XML."""
MANY_NUMBERS = 50
"""Size of an array above which its text is kept for the next scene."""
FINGERTIP_BIT, TABLE_BIT, SHAPE_BIT = 1, 2, 1 << 20
"""Bits of what fingertips touch, of what a table does, and of what the shapes of links may touch
besides."""
ORIGIN = (0.0, 0.0, 0.0)
IDENTITY_POSE = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
"""Position and quaternion of a body that is where its scene has put it, (7,)."""
IDENTITY_POSE.setflags(write=False)
FREE_JOINT = {"pos": ORIGIN, "limited": "false", "damping": 0.0, "stiffness": 0.0, "armature": 0.0,
        "frictionloss": 0.0}  # fmt: skip
TIP_LOOK = {"contype": 0, "conaffinity": 0, "mass": 0.0, "group": 0, "rgba": (0.8, 0.25, 0.2, 1.0)}


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


def rotations(quaternions: Array) -> Array:
    """Return the rotation matrices of unit quaternions (w, x, y, z), (n, 4), as (n, 3, 3)."""
    w, x, y, z = quaternions.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.array(rows).transpose(2, 0, 1)


def six_of(inertia: Array) -> Array:
    """Return the numbers of MJCF's `fullinertia`, (6,), of a matrix (3, 3)."""
    return inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]


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


Parts: TypeAlias = Mapping[str, Element]


def element(tag: str, attributes: Mapping[str, object]) -> Element:
    """Make an element with attributes of any plain kind."""
    parts = [f' {name}="{as_text(value)}"' for name, value in attributes.items()]
    return Element(tag, "".join(parts))


def add_element(parent: Element, tag: str, attributes: Mapping[str, object]) -> Element:
    """Add an element with attributes of any plain kind."""
    added = element(tag, attributes)
    parent.inside.append(added)
    return added


def add_comment(parent: Element, text: str) -> None:
    """Add a comment for people who read the file; MuJoCo does not read it."""
    parent.inside.append(Element("", text.replace("--", "- -")))  # XML ends comments with `--`


def placed(position: Array, rotation: Array) -> dict[str, object]:
    """Return the attributes of a body or shape at a position (3,) [m] with axes (3, 3)."""
    return {"pos": position, "quat": quaternion(rotation)}


def add_servo(
    actuators: Element, joint: str, stiffness: float, damping: float,
    limits: tuple[float, float] | None = None, span: tuple[float, float] | None = None,
    pulls: str = "joint",
) -> None:  # fmt: skip
    """Add a servo with kp and kv [N/m and N s/m, or N m/rad and N m s/rad].

    Its force [N or N m] and its command [m or rad] may have limits. It turns a joint, or pulls a
    tendon.
    """
    servo: dict[str, object] = {"name": joint, pulls: joint, "kp": stiffness, "kv": damping}
    servo["ctrllimited"] = "false" if span is None else "true"
    servo["forcelimited"] = "false" if limits is None else "true"
    servo |= {} if span is None else {"ctrlrange": span}
    servo |= {} if limits is None else {"forcerange": limits}
    add_element(actuators, "position", servo)


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


def as_text(value: object) -> str:
    """Write a number in full precision, a sequence of them separated by blanks, or words."""
    if isinstance(value, str):
        return value.translate(ESCAPED)
    if type(value) in (float, int):  # the most frequent ones, and an array would take longer
        return repr(value)
    numbers: Array | Indices = np.asarray(value)
    if numbers.size > MANY_NUMBERS:
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
