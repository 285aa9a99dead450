"""Long and thin shapes in random orientations: how long does loading take, and at worst?

    python -m tests.benchmarks.long_shapes

Each line is a shape with one kind of faces in 20 orientations: its triangles, how many were loaded,
the median and the longest processor time, and their ratio. A refusal would be named below it.
"""

import time

import numpy as np

import grasp_core as gc
from tests.grasp_core.long_shapes import KINDS, ORIENTATIONS, SHAPES, lying, shape


def main():
    """Load every shape with every kind of faces, and print a line for each."""
    worst = 0.0
    print("shape            triangles  faces    loaded  median ms  longest ms  ratio")
    for name in SHAPES:
        for kind in KINDS:
            seconds, refusals = loading(name, kind)
            median, longest = np.median(seconds), max(seconds)
            worst = max(worst, longest / median)
            print(
                f"{name:15s} {len(shape(name)[1]):10d}  {kind:8s} {ORIENTATIONS - len(refusals):5d}"
                f" {1e3 * median:10.1f} {1e3 * longest:11.1f} {longest / median:6.2f}",
                *sorted(refusals), sep="\n  ", flush=True,
            )  # fmt: skip
    print(f"largest ratio {worst:.2f}")


def loading(name, kind):
    """Processor time of each orientation [s], and the refusals, after one that does not count."""
    seconds, refusals = list[float](), list[str]()
    for number in (0, *range(ORIENTATIONS)):
        vertices, triangles = lying(name, number)
        begun = time.process_time()
        try:
            gc.Polyhedron.from_mesh(vertices, triangles, faces=kind)
        except gc.MeshError as error:
            refusals.append(f"{number}: {error}")
        seconds.append(time.process_time() - begun)
    return seconds[1:], set(refusals)


if __name__ == "__main__":
    main()
