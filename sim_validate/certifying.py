"""Regions certified for many grasps, in parallel."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from grasp_core.certified_regions import CONES, Balance, CertifiedRegions, certify_regions
from grasp_core.plans import Plan
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
    return certify_regions(
        task.body, task.grasp, asked.friction, reserve=asked.reserve, balance=asked.balance,
        recenter=asked.recenter, clearance=asked.clearance, cones=asked.cones,
    )  # fmt: skip


def with_regions(
    body: Polyhedron, found: Plan, *, clearance: float, jobs: int, reporter: Reporter
) -> Plan:
    """The plan with certified regions where their smallest disc is larger than the planned one."""
    asked = Asked(found.friction, clearance=clearance)
    grasps = [
        _wider(grasp, proved)
        for grasp, proved in certified(body, found.grasps, asked, jobs=jobs, reporter=reporter)
    ]
    widened = sum(new is not old for new, old in zip(grasps, found.grasps, strict=True))
    reporter.say(f"{widened} of {len(grasps)} grasps got larger regions with proofs of their own")
    return replace(found, grasps=tuple(grasps))


def _wider(grasp: Grasp, proved: CertifiedRegions | None) -> Grasp:
    if proved is None:
        return grasp
    radius = min(region.inscribed_radius for region in proved.regions)
    planned = min(region.inscribed_radius for region in grasp.regions)
    return grasp if radius <= planned else replace(grasp, regions=proved.regions, radius=radius)
