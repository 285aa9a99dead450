"""Regions certified for many grasps, in parallel."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from grasp_core.arrays import Array
from grasp_core.certified_regions import CONES, Balance, CertifiedRegions, certify_regions
from grasp_core.closure import force_closure
from grasp_core.errors import UndecidedError
from grasp_core.values import Grasp, Polyhedron
from sim_validate.console import Reporter
from sim_validate.engines import each


@dataclass(frozen=True, slots=True)
class Asked:
    """How regions are certified; see `certify_regions`."""

    friction: float
    reserve: float = 0.0
    balance: Balance = "radius"
    recenter: bool = False
    clearance: float = 0.0
    cones: int = CONES


@dataclass(frozen=True, slots=True, eq=False)
class _Task:
    """One grasp, as it travels to a worker."""

    body: Polyhedron
    grasp: Grasp
    asked: Asked


def certified(
    body: Polyhedron, grasps: Sequence[Grasp], asked: Asked, *, jobs: int, reporter: Reporter
) -> Iterator[tuple[Grasp, CertifiedRegions | None]]:
    """Each grasp with its regions, in order."""
    tasks = [_Task(body, grasp, asked) for grasp in grasps]
    with reporter.progress("certifying") as steps:
        for done, (grasp, proved) in enumerate(
            zip(grasps, each(_certify, tasks, jobs=jobs), strict=True)
        ):
            steps.update(done + 1, len(tasks))
            yield grasp, proved


def _certify(task: _Task) -> CertifiedRegions | None:
    asked = task.asked
    if not _closed(task.grasp, asked.friction * (1.0 - asked.reserve)):
        return None
    return certify_regions(
        task.body, task.grasp, asked.friction, reserve=asked.reserve, balance=asked.balance,
        recenter=asked.recenter, clearance=asked.clearance, cones=asked.cones,
    )  # fmt: skip


def _closed(grasp: Grasp, friction: float) -> bool:
    try:
        return force_closure(grasp.positions, grasp.normals, friction).closed
    except UndecidedError:
        return False


def wider(grasp: Grasp, proved: CertifiedRegions | None) -> Grasp:
    """A grasp with certified regions where their discs around its contacts are larger."""
    if proved is None:
        return grasp
    radius = min(
        _room(region.polygon, contact.position, normal)
        for region, contact, normal in zip(
            proved.regions, grasp.contacts, proved.normals, strict=True
        )
    )
    if radius <= grasp.radius and grasp.regions[0].kind != "point":
        return grasp
    return replace(grasp, regions=proved.regions, radius=max(radius, 0.0))


def _room(polygon: Array, point: Array, normal: Array) -> float:
    """How far a point is inside of a convex polygon (c, 3), across its plane or not [m]."""
    edges = np.roll(polygon, -1, axis=0) - polygon
    inward = np.cross(normal, edges)
    inward /= np.linalg.norm(inward, axis=1, keepdims=True)
    return float(np.einsum("ci,ci->c", inward, point - polygon).min())
