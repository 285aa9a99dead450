"""Says in words where a planar face is, so that a reader finds it without its number.

Normals point into the part. In words a face has a side that it faces, which is outwards, as a
person sees it: `facing +x at x = 60 mm`, or `facing (0.71, 0, 0.71) around (10, 20, 5) mm` where it
is parallel to no plane of the axes.
"""

import math
from typing import TypeAlias

from grasp_core.arrays import Array
from grasp_core.objects.surface import Face

Triple: TypeAlias = tuple[float, float, float]
ALONG = 1e-4
"""Largest angle from an axis at which a face counts as facing along it [rad]: six digits turn a
face by no more."""
MM = 1e3
NOTHING_MM = 1e-6
"""Coordinate that is written as zero [mm]."""


def triple(numbers: Array) -> Triple:
    """Turn an array of three numbers into plain ones."""
    x, y, z = numbers.tolist()
    return x, y, z


def face_in_words(face: Face) -> str:
    """Say where a face of a part is."""
    return place_in_words(triple(face.normal), triple(face.centroid))


def place_in_words(normal: Triple, center: Triple) -> str:
    """Say where a face is, such as `facing +x at x = 60 mm`.

    Takes `center` [m].
    """
    outward = [-each for each in normal]
    axis = max(range(3), key=lambda index: abs(outward[index]))
    across = math.hypot(*(each for index, each in enumerate(outward) if index != axis))
    if across <= ALONG:
        name = "xyz"[axis]
        sign = "+" if outward[axis] > 0.0 else "-"
        return f"facing {sign}{name} at {name} = {in_mm(center[axis])} mm"
    side = ", ".join(f"{round(each, 2) + 0.0:g}" for each in outward)
    return f"facing ({side}) around ({', '.join(map(in_mm, center))}) mm"


def in_mm(length: float) -> str:
    """Write a coordinate [m] in millimetres, without the digits that are rounding."""
    value = MM * length
    return f"{0.0 if abs(value) < NOTHING_MM else value:.5g}"
