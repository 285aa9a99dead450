"""Twenty long or thin shapes of 12 to 4,000 triangles, each in twenty orientations."""

from functools import cache, partial

import numpy as np
import trimesh

MM = 1e-3
KINDS = ("auto", "planar", "patches")
"""Kinds of faces that are asked for."""


def turned(outline, sides):
    """The solid that radii and heights [mm], counter-clockwise, make when turned about z."""
    return trimesh.creation.revolve(np.array(outline, dtype=float), sections=sides)


def rod(diameter, length, sides, rings=1):
    """A round rod, its side cut into rings of triangles."""
    side = [(0.5 * diameter, height) for height in np.linspace(0.0, length, rings + 1)]
    return turned([(0.0, 0.0), *side, (0.0, length)], sides)


def pipe(inner, outer, length, sides, rings=1):
    heights = np.linspace(0.0, length, rings + 1)
    outline = [(0.5 * outer, height) for height in heights]
    outline += [(0.5 * inner, height) for height in heights[::-1]]
    return turned([*outline, outline[0]], sides)


def test_tube(diameter, wall, length, sides, steps):
    """A tube that is open above and ends in half a ball below."""
    arc = np.linspace(-0.5 * np.pi, 0.0, steps)
    ball = np.column_stack([np.cos(arc), np.sin(arc)])
    ball[0, 0] = 0.0
    outside, inside = 0.5 * diameter * ball, (0.5 * diameter - wall) * ball
    rims = [(0.5 * diameter, length), (0.5 * diameter - wall, length)]
    return turned([*outside, *rims, *inside[::-1]], sides)


test_tube.__test__ = False  # pytest takes it for a test elsewhere


def bar(*sizes):
    return trimesh.creation.box(sizes)


def with_holes(sizes, diameter, count, sides):
    """A bar with a row of round holes through its thickness."""
    drills = list[trimesh.Trimesh]()
    for at in sizes[0] * ((np.arange(count) + 0.5) / count - 0.5):
        drills.append(rod(diameter, 3.0 * sizes[2], sides))
        drills[-1].apply_translation((at, 0.0, -1.5 * sizes[2]))
    return trimesh.boolean.difference([bar(*sizes), *drills], engine="manifold")


def card(sizes, radius, steps):
    """A card with round corners."""
    arc = np.linspace(0.0, 0.5 * np.pi, steps)
    corner = [0.5 * sizes[0], 0.5 * sizes[1]] - radius * np.column_stack(
        [1.0 - np.cos(arc), 1.0 - np.sin(arc)]
    )
    outline = np.vstack([corner, -corner * [1, -1], -corner, corner * [1, -1]])
    return prism(outline, sizes[2])


def prism(outline, height):
    """The convex hull of points of a plane, made as high."""
    levels = [np.column_stack([outline, np.full(len(outline), z)]) for z in (0.0, height)]
    return trimesh.convex.convex_hull(np.vstack(levels))


def finely(mesh, longest):
    """Divide the triangles of a solid until no edge is longer than a length [mm]."""
    return trimesh.Trimesh(*trimesh.remesh.subdivide_to_size(mesh.vertices, mesh.faces, longest))


def bent(mesh, radius):
    """A long body along x, bent around an axis along y."""
    angle, away = mesh.vertices[:, 0] / radius, radius + mesh.vertices[:, 2]
    points = np.column_stack([away * np.sin(angle), mesh.vertices[:, 1], away * np.cos(angle)])
    return trimesh.Trimesh(points, mesh.faces)


SHAPES = {
    "rod": partial(rod, 10, 100, 256),
    "thin rod": partial(rod, 2, 400, 64),
    "needle": partial(rod, 0.6, 300, 16),
    "fine rod": partial(rod, 8, 160, 1000),
    "ringed rod": partial(rod, 12, 240, 48, 40),
    "hexagonal bar": partial(rod, 6, 300, 6),
    "pipe": partial(pipe, 18, 20, 200, 128),
    "long pipe": partial(pipe, 9, 10, 1000, 64),
    "fine pipe": partial(pipe, 24, 30, 150, 500),
    "straw": partial(pipe, 5.6, 6, 210, 64),
    "ringed straw": partial(pipe, 5.6, 6, 210, 24, 40),
    "test tube": partial(test_tube, 16, 1, 140, 48, 9),
    "fine test tube": partial(test_tube, 12, 0.8, 90, 96, 10),
    "sheet": partial(bar, 200, 150, 0.5),
    "ruler": partial(bar, 300, 30, 1),
    "square bar": partial(bar, 320, 16, 3),
    "fine sheet": lambda: finely(bar(200, 150, 0.5), 13.0),
    "card": partial(card, (85.6, 54.0, 0.76), 3.2, 16),
    "bar with holes": partial(with_holes, (240, 20, 3), 8, 9, 32),
    "bent strip": lambda: bent(finely(bar(200, 12, 1), 8.0), 120.0),
}
"""Makers of the shapes [mm], by name."""


@cache
def shape(name):
    """Vertices [m] and triangles of a shape as it is made."""
    made = SHAPES[name]()
    mesh = trimesh.Trimesh(made.vertices, made.faces)
    mesh.merge_vertices()
    return MM * mesh.vertices, np.array(mesh.faces)


def lying(name, number):
    """The shape in one of its random orientations, the first as it is made."""
    vertices, triangles = shape(name)
    if number == 0:
        return vertices, triangles
    rng = np.random.default_rng([list(SHAPES).index(name), number])
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return vertices @ (turn * np.sign(np.linalg.det(turn))).T, triangles
