"""Group 5: surfaces that bound no one solid, or one that is too small, large or fine."""

import numpy as np

from tests.bad_input.cases import read, refused
from tests.bad_input.mesh_texts import CORNERS, TRIANGLES, boxes, obj, turned

BOX = boxes(((0, 0, 0), 0.1))
TWO = boxes(((0, 0, 0), 0.1), ((0.2, 0, 0), 0.1))


def _moebius(n: int = 24) -> tuple[list, list]:
    """A strip with half a turn: its triangles cannot be wound alike."""
    points, faces = [], []
    for i in range(n):
        u = 2 * np.pi * i / n
        for v in (-0.02, 0.02):
            r = 0.1 + v * np.cos(u / 2)
            points.append((float(r * np.cos(u)), float(r * np.sin(u)), float(v * np.sin(u / 2))))
        a, b = 2 * i, 2 * i + 1
        c, d = (2 * i + 2, 2 * i + 3) if i < n - 1 else (1, 0)
        faces += [(a, b, c), (b, d, c)]
    return points, faces


def _crowded(count: int) -> tuple[list, list]:
    """A fan over points that nearly coincide."""
    rng = np.random.default_rng(1)
    near = 1e-10 * rng.random((count, 3))
    points = [*CORNERS, *map(tuple, near.tolist())]
    return points, [*TRIANGLES, *((4 + i, 4 + (i + 1) % count, 1) for i in range(count))]


OPEN = (CORNERS, TRIANGLES[1:])
BAD = {
    "an open box": ((BOX[0], BOX[1][1:]), "GP-MESH-OPEN|patches"),
    "an open tetrahedron": (OPEN, "GP-MESH-OPEN|patches"),
    "two faces back to back": ((CORNERS, [(0, 1, 2), (2, 1, 0)]), "volume"),
    "an edge of four faces": (
        ([*CORNERS, (-0.1, 0, 0), (0, -0.1, 0)],
         [*TRIANGLES, (0, 4, 5), (0, 5, 3), (0, 3, 4), (4, 3, 5)]), "GP-MESH"),
    "a strip with one side": (_moebius(), "GP-MESH-WINDING|one side|wind"),
    "two solids": (TWO, "GP-MESH-SEPARATE|one solid"),
    "a solid inside a solid": (
        boxes(((0, 0, 0), 0.1), ((0.02, 0.02, 0.02), 0.05)), "GP-MESH-OVERLAP|unite"),
    "solids that share an edge": (
        boxes(((0, 0, 0), 0.1), ((0.1, 0.1, 0), 0.1)), "GP-MESH-SEPARATE|edges or corners"),
    "solids that share a corner": (
        boxes(((0, 0, 0), 0.1), ((0.1, 0.1, 0.1), 0.1)), "GP-MESH-SEPARATE|edges or corners"),
    "a part inside out beside another": (
        (TWO[0], [*TWO[1][:6], *turned(TWO[1][6:])]), "GP-MESH"),
    "a flat solid": (([(x, y, 0) for x, y, _ in CORNERS], TRIANGLES), "GP-MESH-ZERO-VOLUME"),
    "all in one point": (([(0.1, 0.1, 0.1)] * 4, TRIANGLES), "GP-MESH-SIZE|across"),
    "all on a line": (([(0.1 * i, 0, 0) for i in range(4)], TRIANGLES), "GP-MESH"),
    "a sheet 1e-12 thick": (
        ([(x, y, 1e-12 * (z > 0)) for x, y, z in CORNERS], TRIANGLES), "GP-MESH"),
    "a micrometre across": (boxes(((0, 0, 0), 1e-6)), "GP-MESH-SIZE|unit"),
    "a kilometre across": (boxes(((0, 0, 0), 1e3)), "GP-MESH-SIZE|unit"),
    "1e300 across": (boxes(((0, 0, 0), 1e300)), "GP-MESH-SIZE|unit"),
    "1e-300 across": (boxes(((0, 0, 0), 1e-300)), "GP-MESH-SIZE|unit"),
    "from -1e308 to 1e308": (([(-1e308, 0, 0), (1e308, 0, 0), *CORNERS[2:]], TRIANGLES), "GP-MESH"),
    "sixty-five parts": (
        boxes(*(((1e-3 * i, 0, 0), 5e-4) for i in range(65))), "GP-MESH-SEPARATE|65"),
    "points that crowd": (_crowded(300), "GP-MESH"),
    "no triangle but slivers": (
        ([(0, 0, 0), (0.1, 0, 0), (0.05, 1e-12, 0), (0.05, 0, 1e-12)], TRIANGLES), "GP-MESH"),
}  # fmt: skip
FLAGS = {
    "six faces of five allowed": (
        BOX, "--max-faces 5 --faces planar", "GP-MESH-TOO-MANY|planar faces|patches|--max-faces"),
    "twelve triangles of ten allowed": (
        BOX, "--max-triangles 10", "GP-MESH-TOO-MANY|--max-triangles"),
    "two parts of one allowed": (TWO, "--max-parts 1", "GP-MESH-SEPARATE|--max-parts"),
    "patches of a box that is open in all": (
        ([*CORNERS], [(0, 1, 2)]), "--faces patches", "GP-MESH-OPEN|which side|largest-part"),
    "a centre of mass far off": (BOX, "--center-of-mass-m 9 9 9", "center_of_mass"),
    "in inches by mistake": (boxes(((0, 0, 0), 1000.0)), "--unit in", "GP-MESH-SIZE|unit"),
}  # fmt: skip
GOOD = {
    "one face turned": (CORNERS, [TRIANGLES[0][::-1], *TRIANGLES[1:]]),
    "half of a box turned": (BOX[0], [*BOX[1][:3], *turned(BOX[1][3:])]),
    "solids that overlap": boxes(((0, 0, 0), 0.1), ((0.05, 0.03, 0.02), 0.1)),
    "solids that share a face": boxes(((0, 0, 0), 0.1), ((0.1, 0, 0), 0.1)),
    "inside out": (CORNERS, turned(TRIANGLES)),
    "a face twice": (CORNERS, [*TRIANGLES, TRIANGLES[0]]),
    "a face twice, once from behind": (CORNERS, [*TRIANGLES, TRIANGLES[0][::-1]]),
    "a triangle without area": (CORNERS, [*TRIANGLES, (0, 1, 1)]),
    "a cavity": (
        boxes(((0, 0, 0), 0.1), ((0.02, 0.02, 0.02), 0.05))[0],
        [*BOX[1], *turned(boxes(((0, 0, 0), 0.1), ((0.02, 0.02, 0.02), 0.05))[1][6:])],
    ),
    "a metre from the origin": boxes(((1.0, 1.0, 1.0), 0.1)),
    "a million metres from the origin, and single points apart": boxes(((2.0**20,) * 3, 0.125)),
    "vertices that nobody uses": ([*CORNERS, (9e9, 0, 0)], TRIANGLES),
    "off plane by 1e-8": ([*BOX[0][:-1], (0.1, 0.1, 0.1 + 1e-8)], BOX[1]),
}
CASES = [refused(name, "part.obj", obj(*surface), says) for name, (surface, says) in BAD.items()]
CASES += [
    refused(name, "part.obj", obj(*surface), says, f"inspect FILE {flags}")
    for name, (surface, flags, says) in FLAGS.items()
]
CASES += [read(f"{name}.obj", obj(*surface)) for name, surface in GOOD.items()]
