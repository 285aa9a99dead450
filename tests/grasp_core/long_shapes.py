"""Long and thin shapes, each turned at random."""

from functools import partial

import numpy as np
import trimesh

MM = 1e-3


def rod(diameter, length, sides):
    """A round rod along z."""
    outline = [(0.0, 0.0), (0.5 * diameter, 0.0), (0.5 * diameter, length), (0.0, length)]
    return trimesh.creation.revolve(np.array(outline), sections=sides)


def with_holes(sizes, diameter, count, sides):
    """A bar with a row of round holes through its thickness."""
    drills = list[trimesh.Trimesh]()
    for at in sizes[0] * ((np.arange(count) + 0.5) / count - 0.5):
        drills.append(rod(diameter, 3.0 * sizes[2], sides))
        drills[-1].apply_translation((at, 0.0, -1.5 * sizes[2]))
    bar = trimesh.creation.box(sizes)
    return trimesh.boolean.difference([bar, *drills], engine="manifold")


SHAPES = {
    "rod": (partial(rod, 10, 100, 256), 0),
    "square bar": (partial(trimesh.creation.box, (320, 16, 3)), 15),
    "bar with holes": (partial(with_holes, (240, 20, 3), 8, 9, 32), 18),
}
"""Makers of the shapes [mm] and seeds of their turns, by name."""


def lying(name):
    """Vertices [m] and triangles of a shape that lies anyhow."""
    make, seed = SHAPES[name]
    made = make()
    mesh = trimesh.Trimesh(made.vertices, made.faces)
    mesh.merge_vertices()
    turn = np.linalg.qr(np.random.default_rng([seed, 1]).normal(size=(3, 3)))[0]
    return MM * mesh.vertices @ (turn * np.sign(np.linalg.det(turn))).T, np.array(mesh.faces)
