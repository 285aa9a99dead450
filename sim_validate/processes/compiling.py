"""Compiles inner loops before they are needed, in two processes at once.

Compiling all that a plan needs takes a minute of one core, once, and what reaches with a hand half
a minute more. Each call here uses some kernels on a small example, so that their loops are kept;
two processes that make different calls compile different loops, but for a few that both need. Where
a call fails, its loops are compiled when they are needed.
"""

from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import NamedTuple

import numpy as np

from grasp_core.closure.critical_friction import critical_friction
from grasp_core.closure.force_closure import force_closure
from grasp_core.compiled import is_kept
from grasp_core.cones.tilting import toward
from grasp_core.names import Family
from grasp_core.planning.planner import plan
from grasp_core.quality.ferrari_canny import ferrari_canny
from grasp_core.solvers.qp import least_distance
from scenes.example_objects import example_object
from sim_validate.processes.workers import each

OUTWARD = np.array([[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]])
"""Outward directions of a tetrahedron's faces, (4, 3); a third of each is its face's middle [m]."""
CONTACTS = OUTWARD / 3.0, -OUTWARD / np.sqrt(3.0)
FRICTION = 0.5


class Loops(NamedTuple):
    """Some kernels whose loops are kept once all calls were made, without package and ending."""

    kernels: tuple[str, ...]
    calls: tuple[Callable[[], object], ...]


def _planned(*families: Family) -> None:
    plan(example_object("tetrahedron"), FRICTION, families=families)


def _regions() -> None:
    from grasp_core.regions.certify_regions import certify_regions

    body = example_object("tetrahedron")
    certify_regions(body, plan(body, FRICTION, limit=1).grasps[0], FRICTION)


def _best() -> None:
    from grasp_core.optimizing.best_grasp import best_grasp

    best_grasp(example_object("tetrahedron"), FRICTION, gap=0.5).verify()


def _clearance() -> None:
    from scenes.mujoco.surface import touched_solids

    body = example_object("l-bracket")
    touched_solids(body, body.vertices[:1], body.radius)


def _hand_reach() -> None:
    from grasp_core.hands.hand import load_hand
    from grasp_core.hands.reach import reach_with

    body = example_object("tetrahedron")
    grasp = plan(body, FRICTION, limit=1).grasps[0]
    reach_with(load_hand("allegro"), body, grasp, FRICTION, table_down=(0.0, 0.0, -1.0))


PLANNING = Loops(
    ("families.placing", "families.regulus", "closure.critical_friction",
     "quality.ferrari_canny"),
    (
        partial(_planned, "concurrent", "pencil"),
        partial(least_distance, CONTACTS[0][:3], -np.ones(3)),
        partial(force_closure, *CONTACTS, FRICTION), partial(critical_friction, *CONTACTS),
        partial(_planned, "regulus"), partial(ferrari_canny, *CONTACTS, FRICTION, torque_scale=1.0),
        partial(toward, np.zeros((1, 3)), *np.array(CONTACTS)[:, None], np.full((1, 4), FRICTION)),
    ),
)  # fmt: skip
"""What compiles the loops that plans need."""
REACHING = Loops(("hands.collisions", "hands.pose"), (_hand_reach,))
"""What compiles the loops that put hands to contacts."""
EVERYTHING = Loops(
    (*PLANNING.kernels, *REACHING.kernels, "regions.cover", "optimizing.search"),
    (*PLANNING.calls, _best, *REACHING.calls, _regions, _clearance),
)
"""What compiles all loops that there are."""


def must_compile(loops: Loops, jobs: int) -> bool:
    """Return whether some of the loops are not kept yet, and two processes may compile them.

    With one job, loops are compiled where they are needed, and no others.
    """
    kept = (is_kept(f"grasp_core.{name}_kernel") for name in loops.kernels)
    return jobs > 1 and not all(kept)


def compile_loops(loops: Loops, jobs: int = 2) -> None:
    """Compile loops, or load what is kept, in this process and in another."""
    for _ in each(_made, loops.calls, jobs=min(jobs, 2)):
        pass


def _made(call: Callable[[], object]) -> None:
    with suppress(Exception):
        call()
