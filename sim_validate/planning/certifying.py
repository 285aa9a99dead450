"""Certifies contact regions of many grasps in parallel: polygons in which each finger may stand."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeAlias

import numpy as np

from grasp_core.arrays import Array
from grasp_core.closure.force_closure import force_closure
from grasp_core.errors import SolverError, UndecidedError
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.regions.certificates import CertifiedRegions
from grasp_core.regions.certify_regions import CONES, certify_regions
from grasp_core.values import Grasp
from sim_validate.kit.processes import each

Found: TypeAlias = tuple[Grasp, CertifiedRegions | str]
"""A grasp, with its certified regions or the reason why it has none."""


@dataclass(frozen=True, slots=True)
class Asked:
    """How to certify regions; the fields are those of `grasp_core.certify_regions`."""

    friction: float
    reserve: float = 0.0
    recenter: bool = False
    clearance: float = 0.0
    max_cones: int = CONES


def certified(
    body: Polyhedron, grasps: Sequence[Grasp], asked: Asked, *, jobs: int,
    progress: Callable[[int, int], None],
) -> Iterator[Found]:  # fmt: skip
    """Yield each grasp, in order, with its certified regions or the reason why it has none.

    Takes `progress` (done, total).
    """
    proofs = each(partial(_certify, body, asked), grasps, jobs=jobs)
    for done, found in enumerate(zip(grasps, proofs, strict=True), start=1):
        progress(done, len(grasps))
        yield found


def _certify(body: Polyhedron, asked: Asked, grasp: Grasp) -> CertifiedRegions | str:
    left = asked.friction * (1.0 - asked.reserve)
    try:
        if not force_closure(grasp.positions, grasp.normals, left).closed:
            return f"not in force closure at friction {left:.6g}"
        proved = certify_regions(
            body, grasp, asked.friction, reserve=asked.reserve, recenter=asked.recenter,
            clearance=asked.clearance, max_cones=asked.max_cones,
        )  # fmt: skip
    except (UndecidedError, SolverError) as error:
        return str(error)
    return "no radius could be proved" if proved is None else proved


def wider(grasp: Grasp, proved: CertifiedRegions | str) -> Grasp:
    """Give a grasp its certified regions if their discs around its contacts are larger."""
    if isinstance(proved, str):
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
    """Compute how far a point lies from the nearest edge of a convex polygon (c, 3) [m]."""
    edges = np.roll(polygon, -1, axis=0) - polygon
    inward = np.cross(normal, edges)
    inward /= np.linalg.norm(inward, axis=1, keepdims=True)
    return float(np.einsum("ci,ci->c", inward, point - polygon).min())
