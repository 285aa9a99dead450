"""Tries the constructions over face quadruples, certifies what they find, and keeps counts.

Quadruples are taken in the order of an upper bound on their radius; with a `limit`, the
search ends when the bound falls below the worst radius kept, so the grasps returned are the
best ones and not merely some.
"""

import math
from bisect import insort
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from typing import TypeAlias

import numpy as np

from grasp_core.arrays import UNIT_SLACK, Array
from grasp_core.closure import LARGEST_FRICTION, critical_friction, force_closure
from grasp_core.concurrent_grasps import (
    ConcurrentPlacement,
    cone_footprint,
    place_concurrent,
)
from grasp_core.errors import InputError, UndecidedError
from grasp_core.face_pieces import FacePiece, inscribed_disc_radius
from grasp_core.ranking import (
    LEAST_RADIUS,
    PiecesByFace,
    Quadruple,
    Ranking,
    pieces_by_face,
    rank_quadruples,
)
from grasp_core.spanning import cones_positively_span
from grasp_core.values import (
    FINGERS,
    Contact,
    ContactRegion,
    Family,
    FamilyCounts,
    ForceCone,
    Grasp,
    Plan,
    PlanCounts,
    Polyhedron,
    four,
)

FAMILIES: tuple[Family, ...] = ("concurrent",)
"""The families that can be planned."""
MAX_FACES = 200
"""65 million quadruples, some 6 million of which span: half a gigabyte."""
Progress: TypeAlias = Callable[[int, int, int], None]
"""Called with quadruples done, quadruples in all, and grasps found so far."""


def plan(  # noqa: PLR0913 - the contract's keywords
    body: Polyhedron,
    friction: float = 0.5,
    *,
    families: Sequence[Family] = FAMILIES,
    theta_deg: float | None = None,
    limit: int | None = None,
    seed: int = 0,
    progress: Progress | None = None,
) -> Plan:
    """Find the four-finger force-closure grasps of an object.

    Args:
        body: The object.
        friction: Coulomb coefficient at every contact.
        families: Which constructions to try.
        theta_deg: Half-angle of the friction cones to plan with [deg]; atan(friction) when
            None, and never more than that.
        limit: Keep only this many grasps, those with the largest radius.
        seed: Recorded with the plan; these constructions draw no random numbers.
        progress: Called after each quadruple.

    Returns:
        The certified grasps, largest radius first, or the reason why there are none.

    Raises:
        InputError: An argument is out of range, or the object has too many faces.
        SolverError: A program was neither solved nor proved infeasible.
    """
    theta = _planned_half_angle(friction, theta_deg)
    _check_request(body, families, limit)
    pieces = pieces_by_face(body)
    quadruples = rank_quadruples(body, pieces, theta)
    grasps, counts = _search_concurrent(body, pieces, friction, quadruples, limit, progress)
    faces = len(body.faces)
    return Plan(
        grasps=grasps,
        friction=friction,
        theta=theta,
        seed=seed,
        counts=PlanCounts(
            faces, math.comb(faces, FINGERS), len(quadruples), {"concurrent": counts}
        ),
        absence=None if grasps else _absence(body.name, len(quadruples)),
    )


def _planned_half_angle(friction: float, theta_deg: float | None) -> float:
    if not 0.0 < friction <= LARGEST_FRICTION:
        raise InputError(
            f"friction must be a positive number up to {LARGEST_FRICTION:g}, got {friction}"
        )
    theta = math.atan(friction)
    if theta_deg is None:
        return theta
    if not 0.0 < theta_deg <= math.degrees(theta) * (1.0 + UNIT_SLACK):
        raise InputError(
            f"theta_deg must be in (0, {math.degrees(theta):.6g}], up to the friction angle of "
            f"friction {friction}; got {theta_deg}. Raise the friction or lower theta"
        )
    return min(math.radians(theta_deg), theta)


def _check_request(body: Polyhedron, families: Sequence[Family], limit: int | None) -> None:
    unknown = [family for family in families if family not in FAMILIES]
    if unknown or not families:
        raise InputError(f"families must be among {', '.join(FAMILIES)}; got {list(families)}")
    if limit is not None and limit < 1:
        raise InputError(f"limit must be at least 1, got {limit}")
    if len(body.faces) > MAX_FACES:
        raise InputError(
            f"{body.name} has {len(body.faces)} planar faces, over the limit of {MAX_FACES}; "
            "simplify the mesh so that flat parts become single faces"
        )


def _absence(name: str, spanning: int) -> str:
    if not spanning:
        return (
            f"{name} has no four faces whose normals keep positively spanning space when each "
            "may tilt within a force cone (P3; no box or prism has), so this construction "
            "offers no grasp"
        )
    return (
        f"{name}: {spanning} face quadruples span (P3), but none has a point that four discs of "
        f"at least {LEAST_RADIUS:g} object radii can aim at, so there is no concurrent grasp"
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Found:
    """A certified placement, before it is written out as a grasp."""

    quadruple: Quadruple
    pieces: tuple[FacePiece, ...]
    placement: ConcurrentPlacement
    margin: float


def _search_concurrent(
    body: Polyhedron,
    pieces: PiecesByFace,
    friction: float,
    quadruples: Ranking,
    limit: int | None,
    progress: Progress | None,
) -> tuple[tuple[Grasp, ...], FamilyCounts]:
    """The best grasps: the search ends when no bound reaches the worst one kept."""
    best: list[_Found] = []
    counts: Counter[str] = Counter()
    for done, quadruple in enumerate(quadruples):
        full = limit is not None and len(best) == limit
        if full and quadruple.bound < best[-1].placement.radius * (1.0 - UNIT_SLACK):
            counts["pruned"] = len(quadruples) - done
            break
        candidates = list(product(*(pieces[face] for face in quadruple.faces)))
        placed = _largest_placement(quadruple, candidates)
        found = placed and _certified(body, friction, quadruple, *placed)
        outcome = "found" if found else "rejected" if placed else "infeasible"
        counts.update({"tried": 1, "solved": len(candidates), outcome: 1})
        if found:
            insort(best, found, key=_by_radius)
            best = best[:limit]
        if progress is not None:
            progress(done + 1, len(quadruples), counts["found"])
    return tuple(_grasp(body, friction, found) for found in best), FamilyCounts(**counts)


def _by_radius(found: _Found) -> tuple[float, tuple[int, ...]]:
    """Largest radius first; ties are broken by the faces, not by rounding."""
    return -float(f"{found.placement.radius:.9g}"), found.quadruple.faces


def _cones(quadruple: Quadruple, pieces: Sequence[FacePiece]) -> list[ForceCone]:
    return [ForceCone(piece.normal, quadruple.half_angle) for piece in pieces]


def _largest_placement(
    quadruple: Quadruple, candidates: Sequence[tuple[FacePiece, ...]]
) -> tuple[tuple[FacePiece, ...], ConcurrentPlacement] | None:
    """The best over all choices of one convex piece per face."""
    best = None
    for pieces in candidates:
        floor = best[1].radius if best else LEAST_RADIUS
        if min(piece.inradius for piece in pieces) < floor:
            continue
        placement = place_concurrent(pieces, _cones(quadruple, pieces), least_radius=floor)
        if isinstance(placement, ConcurrentPlacement):
            best = pieces, placement
    return best


def _certified(
    body: Polyhedron,
    friction: float,
    quadruple: Quadruple,
    pieces: tuple[FacePiece, ...],
    placement: ConcurrentPlacement,
) -> _Found | None:
    """The placement with its margin, if its cones span (P3) and the exact closure test agrees."""
    normals = np.array([piece.normal for piece in pieces])
    if not cones_positively_span(normals, [quadruple.half_angle] * FINGERS):
        return None
    try:
        certificate = force_closure(_at(body, placement.positions), normals, friction)
    except UndecidedError:
        return None
    if not certificate.closed:
        return None
    return _Found(quadruple, pieces, placement, certificate.margin)


def _at(body: Polyhedron, unit_points: Array) -> Array:
    """Points in the pieces' units back in the object's frame [m]."""
    return body.center_of_mass + body.radius * unit_points


def _critical(positions: Array, normals: Array, friction: float) -> float:
    """The critical friction; where it cannot be bracketed, the friction that is proved enough."""
    try:
        return critical_friction(positions, normals)
    except UndecidedError:
        return friction


def _grasp(body: Polyhedron, friction: float, found: _Found) -> Grasp:
    quadruple, pieces, placement = found.quadruple, found.pieces, found.placement
    positions = _at(body, placement.positions)
    normals = np.array([piece.normal for piece in pieces])
    cones = _cones(quadruple, pieces)
    regions: list[ContactRegion] = []
    for piece, cone in zip(pieces, cones, strict=True):
        polygon = cone_footprint(piece, cone, placement.focus)
        disc = body.radius * inscribed_disc_radius(polygon, piece)
        regions.append(ContactRegion("cone", _at(body, polygon), disc))
    return Grasp(
        id="c-" + "-".join(str(face) for face in quadruple.faces),
        family="concurrent",
        faces=quadruple.faces,
        contacts=four(Contact(p, n) for p, n in zip(positions, normals, strict=True)),
        focus_points=_at(body, placement.focus[None]),
        force_cones=four(cones),
        regions=four(regions),
        radius=body.radius * placement.radius,
        span_angle=quadruple.span_angle,
        critical_friction=_critical(positions, normals, friction),
        closure_margin=found.margin,
    )
