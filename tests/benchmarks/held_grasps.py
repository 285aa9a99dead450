"""Squeezed grasps for benchmarks of execution, and loads that grow until a contact slips.

Fingertips have a tenth of the object's radius, or less where they would overlap something.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

import grasp_core as gc
import scenes
from scenes.execution.held_mjcf import build_held_scene
from scenes.fingertips import fitting_radius
from sim_validate.execution import paths
from sim_validate.execution.bench import HeldBench
from sim_validate.execution.paths import Drive, idle
from sim_validate.execution.predictions import held_dynamics
from sim_validate.execution.slips import outcome
from tests.benchmarks.objects import FAMILIES, PAPER

FRICTION = 0.5
PUSH_N = 10.0
OBJECTS = (
    "box", "tetrahedron", "octahedron", "wedge", "chamfered-box", "double-wedge-bar", "prism",
    "l-bracket", "cross", "screwdriver", "hexagonal-pyramid", "dodecahedron", "random-8-3",
    "random-12-1", "random-16-1",
)  # fmt: skip
RAMP_S = 1.5
"""Shortest time in which a load grows [s]."""
RADIANS = 180.0
"""Time in which a load grows, at least, in radians of the slowest natural motion at rest. The
object lags behind the load by the inverse of that, times twice the damping ratio, and grips become
softer as they turn: with a third of the time soft fingertips seem to hold 5 to 15 % more."""
LOST = 3.0
"""Distance at which an object is lost and its trial ends, in its radii."""


@dataclass(frozen=True)
class Case:
    """A grasp to squeeze, from where its object comes from."""

    source: str
    """Name of a built-in object, or path of a mesh file."""
    family: str
    """The method that found it: a construction of the paper, or `free`."""
    grasp: gc.Grasp


def body_of(source: str) -> gc.Polyhedron:
    """Load a built-in object or a mesh file."""
    path = Path(source)
    return gc.load_polyhedron(path) if path.suffix else scenes.example_object(source)


def planned(source: str, count: int) -> list[Case]:
    """Plan a number of grasps of an object, as evenly from the families as it has them."""
    body = body_of(source)
    methods = FAMILIES if len(body.faces) <= 100 else PAPER
    lists = [gc.plan(body, FRICTION, families=(one,), limit=count).grasps for one in methods]
    found = [
        Case(source, method, grasps[turn])
        for turn in range(max(map(len, lists), default=0))
        for method, grasps in zip(methods, lists, strict=True)
        if turn < len(grasps)
    ]
    return found[:count]


def squeezed(
    body: gc.Polyhedron, grasp: gc.Grasp, loads: gc.LoadSet, stiffness: float
) -> gc.BestSqueeze | None:
    """Find the best squeeze with pushes up to `PUSH_N`; None if there is none."""
    try:
        return gc.best_squeeze(
            body, grasp, FRICTION, loads, max_push_n=PUSH_N, stiffness=stiffness,
            tip_radius_m=fitting_radius(body, grasp.positions, grasp.normals),
        )  # fmt: skip
    except gc.NoForcesError:
        return None


def bench_of(body: gc.Polyhedron, grip: gc.Grip, mass_kg: float) -> HeldBench:
    """Compile the scene of a squeezed object."""
    return HeldBench(build_held_scene(body, grip, mass_kg), lost_m=LOST * body.radius)


def slowness(bench: HeldBench, grip: gc.Grip) -> float:
    """Return how long a load has to grow so that the object follows it [s]."""
    frequency = held_dynamics(grip, bench.scene.layout).lowest_frequency
    return max(RAMP_S, RADIANS / frequency)


def ramp(wrench: np.ndarray, most: float, duration_s: float) -> Drive:
    """Return the drive of a wrench that grows evenly up to a multiple."""
    count = paths.samples(duration_s)
    shares = most * np.arange(1, count + 1) / count
    return replace(idle(count), wrenches=shares[:, None] * wrench, shares=shares)


def first_slips(bench: HeldBench, grip: gc.Grip, drives: list[Drive]) -> Iterator[float]:
    """Yield the simulated multiple of first slip of each drive; NaN where the simulator fails."""
    _, state = bench.settled(paths.closing())
    motions = bench.run(drives, state)
    for motion, drive in zip(motions, drives, strict=True):
        if motion.faults:
            yield np.nan
        else:
            shares = drive.shares / float(drive.shares.max())
            found = outcome(
                motion, bench.scene.layout, replace(drive, shares=shares), grip.friction
            )
            yield found.first_slip * float(drive.shares.max())


def spread(values: np.ndarray) -> str:
    """Say where most of some relative errors lie; NaN, where the simulator failed, is the worst."""
    size = np.where(np.isnan(values), np.inf, np.abs(values))
    most = np.quantile(size, 0.99, method="higher")
    return (
        f"median {100 * np.median(size):.2f} %, 99 % within {100 * most:.2f} %, "
        f"from {100 * np.nanmin(values):+.2f} to {100 * np.nanmax(values):+.2f} %"
    )
