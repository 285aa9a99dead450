"""How near to the best possible grasps come: `python -m tests.benchmarks.best_grasps`.

For each object and friction: the best grasp found, the bound that no four contacts exceed, the gap,
the time of the search and of checking its proof, and the best planned grasp of the paper's three
families and of the free method, as a share of the best grasp's quality. Planned grasps whose
contacts are nearer to an edge than those of the search are left out. With another measure, the
weight or a task of five loads, the last column is the best of the first sixty planned grasps as a
share, wherever their contacts are. `--alone` plans nothing, which takes minutes on many faces. Ends
with an error if a proof does not hold, or a planned or optimised grasp is above its bound.

    python -m tests.benchmarks.best_grasps [OBJECT ...] [--friction MU ...] [--gap 0.05]
        [--measure ferrari-canny|weight|task] [--time-limit-s 180] [--jobs 2] [--alone]
"""

import argparse
import os
import time
from typing import get_args

import numpy as np

import grasp_core as gc
from grasp_core.objects.face_pieces import unit_pieces
from grasp_core.optimizing.best_grasp import measured
from grasp_core.quality.measures import MeasureName
from scenes.example_objects import example_object

OBJECTS = (
    "tetrahedron", "prism", "box", "hexagonal-pyramid", "octahedron", "wedge", "double-wedge-bar",
    "l-bracket", "dodecahedron", "icosahedron", "hex-nut", "cross",
)  # fmt: skip
FRICTIONS = (0.3, 0.5, 0.8)
SIDES = ((0.0, 0.0), (0.3, 0.0), (-0.3, 0.0), (0.0, 0.3), (0.0, -0.3))
TASK = np.array([[x, y, -1.0, 0.0, 0.0, 0.0] for x, y in SIDES])
"""One newton downward, alone and with 0.3 N to each of four sides."""
PLANNED = 60
OPTIMIZED = 3
SLACK = 1e-9


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("objects", nargs="*", default=OBJECTS)
    parser.add_argument("--friction", nargs="+", type=float, default=FRICTIONS)
    parser.add_argument("--gap", type=float, default=0.05)
    parser.add_argument("--measure", choices=get_args(MeasureName), default="ferrari-canny")
    parser.add_argument("--time-limit-s", type=float, default=180.0)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--alone", action="store_true", help="without planned grasps")
    options = parser.parse_args()
    gc.best_grasp(example_object("tetrahedron"), 0.5, gap=0.3).verify()  # compiles
    planned = "families % free %" if options.measure == "ferrari-canny" else "planned %"
    print(f"object faces friction | quality bound gap % | search s check s nodes | {planned}")
    for name in options.objects:
        body = example_object(name)
        for friction in options.friction:
            print(line(body, friction, options), flush=True)
    print(f"load of the machine: {os.getloadavg()[0]:.1f}")


def line(body, friction, options):
    began = time.perf_counter()
    found = gc.best_grasp(
        body, friction, gap=options.gap, time_limit_s=options.time_limit_s, jobs=options.jobs,
        measure=options.measure, wrenches=TASK if options.measure == "task" else None,
    )  # fmt: skip
    searched = time.perf_counter() - began
    began = time.perf_counter()
    assert found.verify()
    checked = time.perf_counter() - began
    shares = usual_shares if options.measure == "ferrari-canny" else other_share
    return (
        f"{body.name} {len(body.faces)} {friction:g} | {found.quality.lower:.4f} {found.bound:.4f} "
        f"{100 * found.gap:.1f} | {searched:.1f} {checked:.2f} {found.history[-1].nodes} | "
        f"{'-' if options.alone else shares(body, friction, found)}"
    )


def usual_shares(body, friction, found):
    """What the best grasp of the families and that of the free method reach, in per cent."""
    plan = gc.plan(body, friction)
    shares = [
        share(body, found, [grasp for grasp in plan.grasps if grasp.id.startswith("f-") == free])
        for free in (False, True)
    ]
    for grasp in plan.grasps[:OPTIMIZED]:
        moved = gc.optimize_contacts(body, grasp, friction, finger_radius=found.clearance)
        assert not clear(body, found, moved.grasp) or moved.after.lower <= found.bound
    return " ".join(shares)


def other_share(body, friction, found):
    """What the best planned grasp reaches of another measure, in per cent."""
    measure = found.proof.measure
    grasps = gc.plan(body, friction, limit=PLANNED).grasps
    each = [(grasp, measured(body, grasp, friction, measure).lower) for grasp in grasps]
    assert all(held <= found.bound for grasp, held in each if clear(body, found, grasp))
    return f"{100 * max(held for _, held in each) / found.quality.lower:.0f}"


def share(body, found, grasps):
    """The best quality of grasps clear of edges, in per cent of the best grasp's."""
    kept = [grasp.ferrari_canny[0] for grasp in grasps if clear(body, found, grasp)]
    assert all(quality <= found.bound for quality in kept)
    return f"{100 * max(kept) / found.quality.lower:.0f}" if kept else "-"


def clear(body, found, grasp):
    """Whether all contacts are where the search looks for them."""
    for face, point in zip(grasp.faces, grasp.positions, strict=True):
        unit = (point - body.center_of_mass) / body.radius
        rooms = [
            piece.inset(unit) >= min(found.clearance / body.radius, 0.5 * piece.inradius) - SLACK
            for piece in unit_pieces(body)
            if piece.face == face
        ]
        if not np.any(rooms):
            return False
    return True


if __name__ == "__main__":
    main()
