"""Moves the contacts of a plan's grasps on their faces to raise their quality, in parallel."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.optimizing.better_contacts import optimize_contacts
from grasp_core.optimizing.ceiling import quality_ceiling
from grasp_core.planning.result import Moved, Plan
from grasp_core.values import Grasp
from sim_validate.kit.processes import each

SAME_CONTACTS = 0.01
"""Distance below which two optimized contacts count as the same [object radii]; searches for one
optimum end some thousandths from it."""


def improved(
    body: Polyhedron, found: Plan, *, finger_radius: float | None, parts: int | None, jobs: int,
    progress: Callable[[int, int, str], None],
) -> Plan:  # fmt: skip
    """Improve each grasp of a plan; return the new plan, best first, with how each grasp changed.

    The plan keeps only one of several grasps that end at the same contacts.

    Takes `finger_radius` [m]; `parts`, the largest number of cases for the bound, None for no
    bound; `progress` (done, total, how many are raised).
    """
    improve = partial(_improve, body, found.friction, finger_radius, found.seed, parts)
    done: list[tuple[Grasp, Moved]] = []
    for grasp, moved in each(improve, found.grasps, jobs=jobs):
        done.append((grasp, moved))
        raised = sum(one.gain > 1.0 for _, one in done)
        progress(len(done), len(found.grasps), f"({raised} raised)")
    done.sort(key=lambda pair: -pair[0].ferrari_canny[0])
    kept: list[Grasp] = []
    for grasp, _ in done:
        if not any(_same_contacts(grasp, other, SAME_CONTACTS * body.radius) for other in kept):
            kept.append(grasp)
    return replace(found, grasps=tuple(kept), moves=tuple(moved for _, moved in done))


def _same_contacts(one: Grasp, two: Grasp, slack: float) -> bool:
    """Tell whether two grasps touch the same faces at the same points, in any order."""
    order, other = np.argsort(one.faces), np.argsort(two.faces)
    faces = np.array_equal(np.array(one.faces)[order], np.array(two.faces)[other])
    return faces and float(np.abs(one.positions[order] - two.positions[other]).max()) <= slack


def _improve(
    body: Polyhedron, friction: float, finger_radius: float | None, seed: int, parts: int | None,
    grasp: Grasp,
) -> tuple[Grasp, Moved]:  # fmt: skip
    found = optimize_contacts(body, grasp, friction, finger_radius=finger_radius, seed=seed)
    ceiling = None
    if parts is not None:
        ceiling = quality_ceiling(
            body, grasp.faces, friction, known=found.after.lower,
            finger_radius=found.clearances, parts=parts,
        ).upper  # fmt: skip
    before, after = found.before, found.after
    moved = Moved(
        found.grasp.id, grasp.id, (before.lower, before.upper), (after.lower, after.upper), ceiling
    )
    return found.grasp, moved
