"""Compiles half of the inner loops in another process, while this one plans.

Compiling everything takes half a minute of one core, once. The planner's search begins with other
loops than the proofs of its grasps, and comes to the last family at the end. So the first use after
an installation compiles on two cores.
"""

from collections.abc import Callable, Generator, Mapping
from concurrent.futures import Future
from contextlib import contextmanager, suppress
from functools import partial
from typing import TypeAlias

import numpy as np

from grasp_core.arrays import Array
from grasp_core.closure.critical_friction import critical_friction
from grasp_core.closure.force_closure import force_closure
from grasp_core.compiled import wait_for
from grasp_core.kept_loops import is_kept
from grasp_core.planning.planner import plan
from grasp_core.quality.ferrari_canny import ferrari_canny
from grasp_core.solvers.nearest_point import least_distance
from scenes.example_objects import example_object
from sim_validate.parallel.processes import local_processes

OUTWARD = np.array([[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]])
"""Outward directions of a tetrahedron's faces, (4, 3); a third of each is its face's middle [m]."""
FRICTION = 0.5
Call: TypeAlias = Callable[[Array, Array], object]
Calls: TypeAlias = Mapping[str, Call]
"""For each kernel a function that compiles it, given four contacts and their normals."""


def _closure(points: Array, normals: Array) -> None:
    force_closure(points, normals, FRICTION)
    critical_friction(points, normals)


def _last_family(_points: Array, _normals: Array) -> None:
    plan(example_object("tetrahedron"), FRICTION, families=("regulus",), limit=1)


def _nearest(points: Array, _normals: Array) -> None:
    least_distance(points[:3], -np.ones((1, 3)))


def _quality(points: Array, normals: Array) -> None:
    ferrari_canny(points, normals, FRICTION, torque_scale=1.0)


BESIDE: Calls = {
    "grasp_core.solvers.nearest_point_kernel": _nearest,
    "grasp_core.closure.critical_friction_kernel": _closure,
    "grasp_core.quality.ferrari_canny_kernel": _quality,
    "grasp_core.families.regulus_kernel": _last_family,
}
"""For each kernel to compile beside a plan, in the order in which the plan and the pages after it
need them, a call that compiles it."""


@contextmanager
def compiled_beside(jobs: int, calls: Calls | None = None) -> Generator[int]:
    """Compile loops in another process during a `with` block, if they are not kept.

    The first use of such a loop in the block waits until that process has compiled it.

    Gives the number of processes that the block may use: one while loops are compiled, as others
    would compile the same loops.
    """
    wanted = BESIDE if calls is None else calls
    missing = {name: call for name, call in wanted.items() if jobs > 1 and not is_kept(name)}
    if not missing:
        yield jobs
        return
    with local_processes(1) as other:
        ready = {name: other.submit(_compile, call) for name, call in missing.items()}
        wait_for({name: partial(_wait, future) for name, future in ready.items()})
        try:
            yield 1
        finally:
            wait_for({})  # what the process has written is whole, so that it may end at any time


def _wait(ready: "Future[None]") -> None:
    """Wait until a kernel is compiled; where the other process fails, this one compiles it."""
    with suppress(Exception):
        ready.result()


def _compile(call: Call) -> None:
    call(OUTWARD / 3.0, -OUTWARD / np.sqrt(3.0))
