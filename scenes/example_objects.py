"""Makes the built-in example objects from coordinates, hulls and unions, at hand size.

All objects are about 0.1 m across, with the origin of their frame near the middle. They range from
the regular solids, whose results are known in closed form, to parts that are hard to plan on: boxes
and prisms without spanning quadruples, an elongated bar without concurrent grasps, and non-convex
parts with holes, notches and handles.
"""

import math
import re
from collections.abc import Callable
from functools import lru_cache
from itertools import product

import numpy as np

from grasp_core.allowed_values import value_of
from grasp_core.arrays import Array
from grasp_core.errors import InputError
from grasp_core.messages import near, shown
from grasp_core.objects.booleans import Solid, extrusion, hull
from grasp_core.objects.polyhedron import Polyhedron

DIGITS = 14
"""Number of digits to which coordinates are rounded before solids are built. The last digit of a
cosine depends on the processor, and the order of the faces could depend on that digit."""
GOLDEN = (1.0 + math.sqrt(5.0)) / 2.0
RANDOM_NAME = re.compile(r"random-(\d{1,3})-(\d{1,9})", re.ASCII)
RANDOM_FACES = range(4, 201)


def example_names() -> tuple[str, ...]:
    """List the names that `example_object` accepts; `random-FACES-SEED` is a pattern."""
    return (*OBJECTS, "random-FACES-SEED")


def example_object(name: str) -> Polyhedron:
    """Return an example object, built once in a process.

    Args:
        name: A name from `example_names`, for instance "wedge" or "random-20-7". Underscores count
            as hyphens.

    Raises:
        InputError: The name is unknown; the message suggests near names.
    """
    value_of(str, name, "name")
    key = name.strip().lower().replace("_", "-")
    body = _built(key)
    if body is not None:
        return body
    hint = near(key, example_names()) or "see `graspproof objects`"
    if key.startswith("random"):
        hint = f"write random-FACES-SEED, FACES from {RANDOM_FACES[0]} to {RANDOM_FACES[-1]}"
    raise InputError(f"there is no built-in object {shown(name)}; {hint}")


@lru_cache(maxsize=64)
def _built(key: str) -> Polyhedron | None:
    """Build the object of a name; None if there is none."""
    match = RANDOM_NAME.fullmatch(key)
    if match and int(match[1]) in RANDOM_FACES:
        solid = _random(int(match[1]), int(match[2]))
    elif key in OBJECTS:
        solid = OBJECTS[key]()
    else:
        return None
    return Polyhedron.from_mesh(solid.vertices, solid.triangles, name=key)


def _signs() -> Array:
    return np.array(list(product((-1.0, 1.0), repeat=3)))


def _box(x: float, y: float, z: float) -> Solid:
    return hull(_signs() * (x, y, z))


def _ring(radius: float, sides: int, z: float, turn: float = 0.0) -> Array:
    angles = 2.0 * np.pi * np.arange(sides) / sides + turn
    around = np.column_stack([np.cos(angles), np.sin(angles)])
    return np.column_stack([radius * np.round(around, DIGITS), np.full(sides, z)])


def _dodecahedron() -> Solid:
    pairs = np.array(list(product((-1.0, 1.0), repeat=2)))
    rows = [np.column_stack([0.0 * pairs[:, 0], pairs[:, 0] / GOLDEN, pairs[:, 1] * GOLDEN])]
    rows += [np.roll(rows[0], turn, axis=1) for turn in (1, 2)]
    return hull(0.035 * np.vstack([_signs(), *rows]))


def _icosahedron() -> Solid:
    pairs = np.array(list(product((-1.0, 1.0), repeat=2)))
    ring = np.column_stack([0.0 * pairs[:, 0], pairs[:, 0], pairs[:, 1] * GOLDEN])
    return hull(0.032 * np.vstack([np.roll(ring, turn, axis=1) for turn in range(3)]))


def _wedge() -> Solid:
    """Make a rough wedge of six irregular vertices: eight triangular faces, no symmetry."""
    corners = [
        [-5.0, -3.5, -2.5], [5.5, -2.5, -3.0], [4.5, 3.0, -2.0],
        [-4.5, 4.0, -3.0], [-3.5, -0.5, 4.0], [3.0, 0.8, 3.5],
    ]  # fmt: skip
    return hull(0.01 * np.array(corners))


def _chamfered_box() -> Solid:
    """Make a box of 12 x 10 x 8 cm with its eight corners cut off."""
    widths, cut = np.array([0.06, 0.05, 0.04]), 0.02
    corners = _signs()[:, None, :] * (widths - cut * np.eye(3))[None]
    return hull(corners.reshape(-1, 3))


def _double_wedge_bar() -> Solid:
    """Make a bar that ends in two crossed wedges: it has pencil grasps, no concurrent one."""
    length, unit = 3.0, 0.02
    ends = [[-length - 1.0, 0.0, s] for s in (-1, 1)] + [[length + 1.0, s, 0.0] for s in (-1, 1)]
    middle = _signs() * (length, 1.0, 1.0)
    return hull(unit * np.vstack([np.array(ends), middle]))


def _hex_nut() -> Solid:
    bore = _ring(0.024, 16, 0.0)[:, :2]
    return extrusion(_ring(0.045, 6, 0.0)[:, :2], 0.035, [bore]).moved((0.0, 0.0, -0.0175))


def _l_bracket() -> Solid:
    outline = [[0.0, 0.0], [0.09, 0.0], [0.09, 0.025], [0.025, 0.025], [0.025, 0.07], [0.0, 0.07]]
    return extrusion(outline, 0.05).moved((-0.03, -0.02, -0.025))


def _cross() -> Solid:
    long, half = 0.055, 0.018
    return _box(long, half, half) + _box(half, long, half) + _box(half, half, long)


def _screwdriver() -> Solid:
    handle = hull(
        np.vstack([_ring(0.014, 8, -0.09), _ring(0.017, 8, -0.06), _ring(0.013, 8, -0.005)])
    )
    shaft = hull(np.vstack([_ring(0.006, 6, -0.02), _ring(0.006, 6, 0.07)]))
    thick = product((-0.007, 0.007), (-0.004, 0.004), (0.06, 0.07))
    edge = product((-0.006, 0.006), (-0.001, 0.001), (0.095,))
    blade = hull([*thick, *edge])
    return handle + shaft + blade


def _mug() -> Solid:
    sides, wall = 12, 0.006
    outside = hull(np.vstack([_ring(0.036, sides, -0.045), _ring(0.042, sides, 0.045)]))
    inside = hull(
        np.vstack([_ring(0.036 - wall, sides, -0.037), _ring(0.042 - wall, sides, 0.046)])
    )
    outline = [[0.030, -0.028], [0.072, -0.020], [0.072, 0.026], [0.030, 0.032]]
    opening = [[0.020, -0.016], [0.060, -0.010], [0.060, 0.016], [0.020, 0.020]]
    flat = extrusion(outline, 0.014, [opening])
    upright = Solid(flat.vertices[:, [0, 2, 1]] * (1.0, -1.0, 1.0), flat.triangles)
    return (outside + upright.moved((0.0, 0.007, 0.0))) - inside


def _random(faces: int, seed: int) -> Solid:
    """Make a solid of random planes tangent to a random ellipsoid, each of which bounds it."""
    rng = np.random.default_rng([faces, seed])
    stretch = rng.uniform(0.7, 1.3, 3)
    for _ in range(MOST_DRAWS):
        normals = rng.normal(size=(faces, 3))
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        polar = hull(normals)
        if len(polar.vertices) == faces:
            corners = _polar_corners(polar)
            outwards = np.sign(np.linalg.det(polar.vertices[polar.triangles]))
            if (outwards / np.linalg.norm(corners, axis=1)).min() > LEAST_POLAR_OFFSET:
                return hull(0.045 * stretch * corners)
    raise InputError(
        f"random-{faces}-{seed}: {MOST_DRAWS} draws made no solid of {faces} faces without a far "
        "corner; take another seed"
    )


MOST_DRAWS = 100_000
"""Draws after which there is no such solid: one in 1,700 is one with four faces, the rarest."""
LEAST_POLAR_OFFSET = 0.25
"""Least distance of a facet of the polar body from the origin. A nearer facet would put a corner of
the object more than four radii away; such thin objects are drawn anew."""


def _polar_corners(solid: Solid) -> Array:
    """Compute the corner p of the polar body for each triangle: p.v = 1 at its vertices v."""
    a, b, c = (solid.vertices[solid.triangles[:, corner]] for corner in range(3))
    crosses = np.cross(b, c) + np.cross(c, a) + np.cross(a, b)
    determinants = (a * np.cross(b, c)).sum(axis=1)
    return np.asarray(np.round(crosses / determinants[:, None], DIGITS), dtype=np.float64)


OBJECTS: dict[str, Callable[[], Solid]] = {
    "tetrahedron": lambda: hull(0.04 * _signs()[[0, 3, 5, 6]]),
    "octahedron": lambda: hull(0.06 * np.vstack([np.eye(3), -np.eye(3)])),
    "dodecahedron": _dodecahedron,
    "icosahedron": _icosahedron,
    "wedge": _wedge,
    "chamfered-box": _chamfered_box,
    "hexagonal-pyramid": lambda: hull(np.vstack([_ring(0.05, 6, -0.02), [[0.0, 0.0, 0.04]]])),
    "box": lambda: _box(0.05, 0.035, 0.025),
    "prism": lambda: hull(np.vstack([_ring(0.05, 3, -0.04), _ring(0.05, 3, 0.04)])),
    "double-wedge-bar": _double_wedge_bar,
    "hex-nut": _hex_nut,
    "l-bracket": _l_bracket,
    "cross": _cross,
    "screwdriver": _screwdriver,
    "mug": _mug,
}
