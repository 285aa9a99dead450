"""Objects of many shapes, the same on every run: hulls, cut solids, and others with dents.

Every object is scaled so that its farthest vertex is 60 mm from its middle.
"""

from collections.abc import Callable, Iterator
from itertools import count, islice
from pathlib import Path

import numpy as np
import trimesh

import scenes

RADIUS_M = 0.06
BUILT_IN = ("tetrahedron", "octahedron", "wedge", "dodecahedron", "double-wedge-bar", "l-bracket")
"""Built-in objects that are stretched and cut."""
Maker = Callable[[np.random.Generator], trimesh.Trimesh]


def hull(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return the hull of 6 to 13 random points."""
    points = rng.normal(size=(int(rng.integers(6, 14)), 3)) * rng.uniform(0.5, 1.0, 3)
    return trimesh.convex.convex_hull(points)


def cut_box(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a box whose corners are cut at random."""
    points = np.concatenate([rng.choice([-1.0, 1.0], (40, 3)), 1.3 * np.eye(3)])
    points *= rng.uniform(0.4, 1.0, (1, 3)) * rng.uniform(0.85, 1.0, points.shape)
    return trimesh.convex.convex_hull(points)


def cut_built_in(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a built-in object, stretched along its axes, without what is beyond a random plane."""
    body = scenes.example_object(str(rng.choice(BUILT_IN)))
    points = (body.vertices - body.center_of_mass) * rng.uniform(0.6, 1.0, 3)
    mesh = trimesh.Trimesh(points, body.triangles)
    normal = rng.normal(size=3)
    normal /= np.linalg.norm(normal)
    depth = rng.uniform(0.3, 0.8) * (mesh.vertices @ normal).max()
    return _less(mesh, _half_space(normal, depth))


def _half_space(normal: np.ndarray, depth: float) -> trimesh.Trimesh:
    """Return a large box that covers what is beyond a plane."""
    size = 10.0
    place = trimesh.geometry.align_vectors([0.0, 0.0, 1.0], normal)
    place[:3, 3] = (depth + 0.5 * size) * normal
    return trimesh.creation.box((size, size, size), place)


def notched(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a box with one or two slots through it, which is not convex."""
    sizes = rng.uniform(1.0, 2.0, 3)
    mesh = trimesh.creation.box(sizes)
    for side in islice((1.0, -1.0), int(rng.integers(1, 3))):
        slot = sizes * [rng.uniform(0.2, 0.5), 2.0, rng.uniform(0.4, 0.8)]
        place = np.eye(4)
        place[:3, 3] = [rng.uniform(-0.15, 0.15) * sizes[0], 0.0, 0.5 * side * sizes[2]]
        mesh = _less(mesh, trimesh.creation.box(slot, place))
    return mesh


def joined(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return two boxes grown together, as an L, a T or a cross."""
    long, high = rng.uniform(1.5, 2.5, 2)
    first = trimesh.creation.box((long, *rng.uniform(0.5, 0.9, 2)))
    place = np.eye(4)
    place[:3, 3] = [rng.choice([-0.35, 0.0, 0.2]) * long, 0.0, rng.choice([0.0, 0.4]) * high]
    second = trimesh.creation.box((*rng.uniform(0.5, 0.9, 2), high), place)
    return trimesh.boolean.union([first, second], engine="manifold")


def _less(mesh: trimesh.Trimesh, cut: trimesh.Trimesh) -> trimesh.Trimesh:
    return trimesh.boolean.difference([mesh, cut], engine="manifold")


MAKERS: tuple[tuple[str, Maker], ...] = (
    ("hull", hull), ("cut-box", cut_box), ("cut", cut_built_in), ("notched", notched),
    ("joined", joined),
)  # fmt: skip


def made_objects() -> Iterator[tuple[str, trimesh.Trimesh]]:
    """Yield names and meshes without end, the kinds by turns."""
    for number in count():
        kind, maker = MAKERS[number % len(MAKERS)]
        mesh = maker(np.random.default_rng([0, number]))
        middle = mesh.bounds.mean(axis=0)
        far = np.linalg.norm(mesh.vertices - middle, axis=1).max()
        yield (
            f"{kind}-{number:03}",
            trimesh.Trimesh((mesh.vertices - middle) * (RADIUS_M / far), mesh.faces),
        )


def write_objects(folder: Path, number: int) -> list[Path]:
    """Write so many meshes, and return their files."""
    folder.mkdir(parents=True)
    files = list[Path]()
    for name, mesh in islice(made_objects(), number):
        files.append(folder / f"{name}.stl")
        files[-1].write_bytes(mesh.export(file_type="stl"))
    return files
