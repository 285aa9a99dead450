"""Numbers, names and rotations as MJCF writes them: in full precision, and printable."""

import math
from collections.abc import Mapping
from xml.etree import ElementTree

import numpy as np

from grasp_core.arrays import Array
from grasp_core.solvers.ties import first_best

COMPILER = {"angle": "radian", "autolimits": "false", "inertiafromgeom": "false"}
"""Settings of the compiler, so that no default matters."""


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


def add_element(
    parent: ElementTree.Element, tag: str, attributes: Mapping[str, object]
) -> ElementTree.Element:
    """Add an element with attributes of any plain kind."""
    text = {name: as_text(value) for name, value in attributes.items()}
    return ElementTree.SubElement(parent, tag, text)


def add_comment(parent: ElementTree.Element, text: str) -> None:
    """Add a comment for people who read the file; MuJoCo does not read it."""
    parent.append(ElementTree.Comment(f" {text} "))


def as_text(value: object) -> str:
    """Write a number in full precision, or a sequence of them separated by blanks."""
    if isinstance(value, str):
        return value
    if type(value) in (float, int):  # the most frequent ones, and an array would take longer
        return repr(value)
    return " ".join(repr(number) for number in np.asarray(value).ravel().tolist())


def printable(name: str) -> str:
    """Replace the characters of a model's name that cannot be printed."""
    return "".join(c if c.isprintable() else "_" for c in name) or "object"
