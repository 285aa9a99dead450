"""Turned, scaled and shaken objects: are the same faces and families found?

    python -m tests.benchmarks.invariance [--quick]

Each case is an object in a random orientation, somewhere, between 1 mm and 1 m across, with every
vertex moved by up to 1e-9 of that. Its plan must hold the same faces
with the same families.
"""

import sys
import time

import numpy as np

import grasp_core as gc
import scenes
from sim_validate.processes.workers import available_cores, each
from tests.judges import random_rotation

OBJECTS = ("box", "prism", "hexagonal-pyramid", "wedge", "l-bracket", "octahedron", "random-8-3")
FRICTIONS = (0.3, 0.5, 0.8)
CASES, QUICK = 1000, 42
SMALLEST_M, LARGEST_M = 1e-3, 1.0
NOISE = 1e-9


def found_on(body, friction):
    """Faces, in any order, and families of the grasps of an object."""
    plan = gc.plan(body, friction)
    return {(*sorted(grasp.faces), grasp.family) for grasp in plan.grasps}


def examine(case):
    """How many grasps there are, and which differ from those of the object as it is."""
    number, expected = case
    name, friction = chosen(number)
    rng = np.random.default_rng(number)
    body = scenes.example_object(name)
    extent = np.ptp(body.vertices, axis=0).max()
    size = np.exp(rng.uniform(np.log(SMALLEST_M), np.log(LARGEST_M)))
    shaken = body.vertices / extent + NOISE * rng.uniform(-1.0, 1.0, body.vertices.shape)
    moved = size * (shaken @ random_rotation(rng).T + rng.uniform(-1.0, 1.0, 3))
    found = found_on(gc.Polyhedron.from_mesh(moved, body.triangles), friction)
    return name, friction, len(expected), sorted(found ^ expected)


def chosen(number):
    """Object and friction of a case."""
    return OBJECTS[number % len(OBJECTS)], FRICTIONS[number // len(OBJECTS) % len(FRICTIONS)]


def main():
    """Count the cases with a difference and show it."""
    count = QUICK if "--quick" in sys.argv[1:] else CASES
    begun = time.perf_counter()
    kinds = {chosen(number) for number in range(count)}
    expected = {kind: found_on(scenes.example_object(kind[0]), kind[1]) for kind in kinds}
    cases = [(number, expected[chosen(number)]) for number in range(count)]
    differing = grasps = 0
    for name, friction, number, differences in each(examine, cases, jobs=available_cores()):
        grasps += number
        if differences:
            differing += 1
            print(f"{name} at {friction}: {len(differences)} differ, such as {differences[:3]}")
    print(
        f"{count} cases of {len(OBJECTS)} objects at friction {FRICTIONS}, {grasps} grasps, "
        f"{differing} cases differ, {time.perf_counter() - begun:.0f} s"
    )
    if differing:
        sys.exit("the planner depends on how an object lies")


if __name__ == "__main__":
    main()
