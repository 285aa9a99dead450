"""Contacts with whole-number coordinates: on boxes, an L, a T and a cross, and on nothing at all.

Such contacts are as degenerate as contacts get, and what holds for them holds exactly.
"""

import numpy as np

from tests.grasp_core.bodies import BODIES, moved
from tests.judges import random_contacts

AXES = np.vstack([np.eye(3), -np.eye(3)])
ARMS = {
    "box": [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)],
    "L": [(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 1, 0), (0, 2, 0)],
    "T": [(-1, 0, 0), (0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 2, 0)],
    "cross": [(0, 0, 0), (-1, 0, 0), (1, 0, 0), (0, -1, 0), (0, 1, 0)],
}
"""Cubes with sides of two, by their centres in such units."""
COUNTS, SHARES = (2, 3, 4, 5, 6), (0.04, 0.1, 0.66, 0.1, 0.1)
"""How many contacts, and how often."""


def surface(cubes):
    """Corners and middles of the outer faces of cubes with their inward normals, (n, 3) each."""
    places, normals = [], []
    for cube in cubes:
        for axis, side in ((axis, side) for axis in range(3) for side in (-1, 1)):
            beside = np.array(cube)
            beside[axis] += side
            if tuple(beside.tolist()) in cubes:
                continue
            for u, v in ((u, v) for u in (-1, 0, 1) for v in (-1, 0, 1)):
                offset = np.zeros(3)
                offset[axis], offset[axis - 2], offset[axis - 1] = side, u, v
                places.append(2 * np.array(cube) + offset)
                normals.append(-side * np.eye(3)[axis])
    return np.array(places, dtype=float), np.array(normals)


SURFACES = {name: surface(cubes) for name, cubes in ARMS.items()}


def anywhere(rng, count, reach=1):
    points = rng.integers(-reach, reach + 1, size=(count, 3)).astype(float)
    return points, AXES[rng.integers(6, size=count)]


def on_a_solid(rng, count):
    points, normals = SURFACES[rng.choice([*SURFACES])]
    chosen = rng.integers(len(points), size=count)
    return points[chosen], normals[chosen]


def on_a_line(rng, count):
    points, normals = anywhere(rng, count)
    direction = AXES[rng.integers(6)] + rng.integers(-1, 2) * AXES[rng.integers(6)]
    return points[:1] + rng.integers(-2, 3, size=(count, 1)) * direction, normals


def in_a_plane(rng, count):
    points, normals = anywhere(rng, count, reach=2)
    points[:, rng.integers(3)] = 0.0
    return points, normals


def repeated(rng, count):
    points, normals = anywhere(rng, count)
    chosen = rng.integers(max(2, count - 1), size=count)
    return points[chosen], normals[chosen]


GRIDS = (on_a_solid, on_a_solid, on_a_solid, on_a_solid, anywhere, on_a_line, in_a_plane, repeated)


def scattered(rng, count):
    """On a body or about a point, now and then turned, moved and of another size."""
    body = rng.choice([*BODIES, "none"])
    if body == "none":
        return random_contacts(rng, count, spread=rng.uniform(0.2, 1.6))
    points, normals = BODIES[body](rng, count)
    size = 10.0 ** rng.uniform(-3.0, 3.0)
    return moved(rng, points, normals, size) if rng.uniform() < 0.3 else (points, normals)


def contact_sets(count, seed):
    """Contacts and whether they are on a grid, every other time: (positions, normals, bool)."""
    rng = np.random.default_rng(seed)
    for i in range(count):
        contacts, grid = int(rng.choice(COUNTS, p=SHARES)), i % 2 == 1
        sampler = GRIDS[rng.integers(len(GRIDS))] if grid else scattered
        yield *sampler(rng, contacts), grid
