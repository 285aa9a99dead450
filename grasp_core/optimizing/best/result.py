"""The best grasp found on an object, with the proof of its gap, and how the search came there."""

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from grasp_core.arrays import Amount, Array
from grasp_core.closure.wrench_sets import WrenchSet
from grasp_core.declared import Declared
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.optimizing.best.search import EXACT_GAP
from grasp_core.optimizing.best.support_cuts import CutTree
from grasp_core.quality.ferrari_canny import FerrariCanny
from grasp_core.quality.measures import Measure, MeasureName, ResistedLoads, measured_set
from grasp_core.values import FINGERS, Grasp

SAME = 1e-7
"""Largest distance between equal points, and directions, in object radii."""
Ended: TypeAlias = Literal["gap", "time", "interrupt", "undivided"]
"""Why a search ended: the gap is reached, time is up, it was interrupted, or polygons became too
small, or too many, to be divided further."""


def are_contacts_of(grasp: Grasp, wrenches: WrenchSet, proof: CutTree) -> bool:
    """Return whether a grasp has a wrench set's contacts, in radii, on polygons of a proof."""
    if wrenches.norm != "l1" or len(wrenches.friction) != FINGERS:
        return False
    if (wrenches.friction != proof.friction).any() or wrenches.width != 3:  # noqa: PLR2004
        return False
    each = wrenches.G.reshape(2, 3, FINGERS, 3).transpose(0, 2, 1, 3)
    turns = each[1] @ each[0].transpose(0, 2, 1)
    normals = each[0, :, :, 0]
    arms = np.stack([turns[:, 2, 1], turns[:, 0, 2], turns[:, 1, 0]], axis=1)
    away, levers = grasp.positions - grasp.positions.mean(axis=0), arms - arms.mean(axis=0)
    size = float((away * levers).sum() / (levers * levers).sum())
    return bool(
        size > 0.0
        and np.abs(away - size * levers).max() <= SAME * size
        and np.abs(grasp.normals - normals).max() <= SAME
    ) and all(_is_on(proof, *contact) for contact in zip(arms, normals, strict=True))


def _is_on(proof: CutTree, point: Array, normal: Array) -> bool:
    grounds = proof.grounds
    for piece, polygon in enumerate(grounds.polygons()):
        away = point - grounds.origins[piece]
        at = grounds.frames[piece].T @ away
        edges = np.roll(polygon, -1, axis=0) - polygon
        beside = edges[:, 0] * (at - polygon)[:, 1] - edges[:, 1] * (at - polygon)[:, 0]
        if (
            abs(float(away @ grounds.normals[piece])) <= SAME
            and np.abs(normal - grounds.normals[piece]).max() <= SAME
            and float(beside.min()) >= -SAME
        ):
            return True
    return False


@dataclass(frozen=True, slots=True)
class GapAt(Declared):
    """How far a search had come at one moment."""

    seconds: float
    """Time since it began [s]."""
    quality: float
    """Quality of the best grasp known then [N], or the multiple of a task's loads."""
    bound: float
    """What no quality exceeds [N], or no multiple."""
    nodes: int
    """How many nodes had been visited."""

    @property
    def gap(self) -> float:
        """Return the share of the bound that is not reached."""
        return 1.0 - self.quality / self.bound


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class BestGrasp(Declared):
    """The best grasp found, with a proved bound of the quality of all others."""

    grasp: Grasp
    quality: FerrariCanny | ResistedLoads
    """Bounds of the grasp's quality (`l1`), with torques over the object's radius; or of the
    largest multiple of the loads of another measure that its contacts resist."""
    clearance: Amount
    """Distance that contacts keep from the edges of faces [m], or half the radius of the largest
    disc in a face where that is less."""
    proof: CutTree
    ended: Ended
    history: tuple[GapAt, ...]
    """How the gap closed; the times do not count when values are compared."""

    @property
    def bound(self) -> float:
        """Return the quality [N] that no four contacts on the faces exceed, clear of the edges.

        For a task it is a multiple of its wrenches, for normal forces of sum one newton.
        """
        return self.proof.bound

    @property
    def measure(self) -> MeasureName:
        """Return the name of the measure that is maximised."""
        return self.proof.measure.name

    @property
    def gap(self) -> float:
        """Return the share of the bound that the grasp's quality does not reach."""
        return 1.0 - self.quality.lower / self.bound

    def verify(self) -> bool:
        """Check the grasp's quality and replay the proof of the bound, without any search.

        The contacts must be those of the quality, and lie on polygons of the proof. Whether these
        are those of an object's faces, this far from edges, can only be checked with the object, by
        `grounds_of`.
        """
        return (
            self.is_sound()
            and self.proof.owners is None  # all contacts, not those on four given faces
            and self._has_its_measure()
            and self.quality.verify()
            and self.proof.verify()
            and self.quality.lower <= self.bound
            and are_contacts_of(self.grasp, self.quality.wrenches, self.proof)
        )

    def _has_its_measure(self) -> bool:
        if isinstance(self.quality, ResistedLoads):
            return self.quality.measure == self.proof.measure
        return self.proof.measure.is_usual


def measured(
    body: Polyhedron, grasp: Grasp, friction: float, measure: Measure, gap: float = EXACT_GAP
) -> FerrariCanny | ResistedLoads:
    """Bound what a grasp of an object resists of the loads of a measure, with proofs."""
    center, scale = body.center_of_mass, body.radius
    wrenches = WrenchSet.of(grasp, None, friction, center=center, torque_scale=scale)
    return measured_set(wrenches, measure, gap)
