"""The planner: from an object and a friction coefficient to certified grasps.

The three constructions of the paper work on quadruples with force cones that positively span (P3),
around the normals or tilted, in the order of an upper bound on their radius; with a `limit`, a
search ends when the bound falls below the worst radius kept, so the grasps returned are the best
ones and not merely some. The free method goes through the quadruples that are left, and proves
for the others that they hold no grasp.
"""

import math
import time
from collections.abc import Iterator, Sequence
from functools import partial
from typing import cast

from grasp_core.checked import function, several, text
from grasp_core.cones.spanning import count_spanning
from grasp_core.families.constructions import LEAST_RADIUS
from grasp_core.objects.planar_faces import MAX_FACES
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.planning.candidates import LEAST_SPAN_ANGLE
from grasp_core.planning.certify import to_grasp
from grasp_core.planning.methods import Progress, Searches
from grasp_core.planning.reach import Finger
from grasp_core.planning.request import METHODS, ConeKind, PlanRequest, RankBy, check_request
from grasp_core.planning.result import Outcomes, Plan, PlanCounts
from grasp_core.planning.selection import chosen
from grasp_core.values import Grasp, Method


def plan(  # noqa: PLR0913 - the contract's keywords
    body: Polyhedron,
    friction: float = 0.5,
    *,
    families: Sequence[Method] | Method = METHODS,
    theta_deg: float | None = None,
    cones: ConeKind = "tilted",
    limit: int | None = None,
    rank_by: RankBy = "radius",
    seed: int = 0,
    cells: int = 1,
    complete: bool = False,
    finger: Finger | None = None,
    clearance: float = 0.0,
    share_faces: float | None = None,
    progress: Progress | None = None,
) -> Plan:
    """Find the four-finger force-closure grasps of an object.

    Args:
        body: The object.
        friction: Coulomb coefficient at every contact.
        families: What to try: constructions of the paper, and `free`, the method without a fixed
            type. Beside constructions it gets the quadruples that they leave over.
        theta_deg: Half-angle of the friction cones to plan with [deg]; atan(friction) when
            None, and never more than that.
        cones: `normal` keeps force cones around the normals, as in the paper; with `tilted` leaning
            ones are tried too.
        limit: Keep only this many grasps.
        rank_by: Which are the best. By `radius`, families take turns, each with its largest discs.
            Reguli and free grasps have no discs; of these the first found count, and free ones
            only as far as the others do not suffice. By `friction-margin` (the least critical
            friction), `ferrari-canny` (the largest quality) and `diverse` (each next one the
            farthest from those before it) all grasps that are found compete.
        seed: For the restarts of the free method.
        cells: Into how many parts the free method may cut the faces of one quadruple.
        complete: Cut the faces that would stay undecided, into 20,000 parts if need be.
        finger: Keep only grasps that such fingers reach on straight free lines.
        clearance: How far contacts and their regions stay from all edges of their faces [m]. Faces
            are cut back by so much, at corners that turn inwards by somewhat more; what is proved
            absent is absent from what is left.
        share_faces: Let two fingers stand on one face, at least so far apart [m]; each face is cut
            once for that, across its longest direction.
        progress: Called after each quadruple that is tried.

    Returns:
        The certified grasps, the best first, or the reason why there are none.

    Raises:
        InputError: An argument is out of range, or the object has too many faces.
        SolverError: A program was neither solved nor proved infeasible.
    """
    request = PlanRequest(
        friction, _listed(families), theta_deg, cones, limit, rank_by, seed, cells, complete,
        finger, clearance, share_faces,
    )  # fmt: skip
    check_request(body, request)
    if progress is not None:
        function(progress, "progress")
    searches = Searches(body, request)
    for _ in searches.run(progress):
        pass
    return _planned(body, request, searches)


def iter_grasps(  # noqa: PLR0913 - as `plan`
    body: Polyhedron,
    friction: float = 0.5,
    *,
    families: Sequence[Method] | Method = METHODS,
    theta_deg: float | None = None,
    cones: ConeKind = "tilted",
    seed: int = 0,
    cells: int = 1,
    finger: Finger | None = None,
    clearance: float = 0.0,
    share_faces: float | None = None,
) -> Iterator[Grasp]:
    """Like `plan`, but yields each grasp as soon as it is certified, in no particular order.

    Raises:
        InputError: As `plan`.
        SolverError: As `plan`.
    """
    request = PlanRequest(
        friction, _listed(families), theta_deg, cones, seed=seed, cells=cells, finger=finger,
        clearance=clearance, share_faces=share_faces,
    )  # fmt: skip
    check_request(body, request)
    searches = Searches(body, request)
    return (to_grasp(body, friction, searches.as_found(each)) for each in searches.run(None))


def _listed(families: Sequence[Method] | Method) -> tuple[Method, ...]:
    if isinstance(families, str):
        return (families,)
    names = several(families, partial(text, name="families"), "families", "names")
    return cast("tuple[Method, ...]", names)  # those that there are, see `check_request`


def _planned(body: Polyhedron, request: PlanRequest, searches: Searches) -> Plan:
    """What the searches found, the best of it as grasps."""
    grasps: list[Grasp] = []
    owner = {id(found): search for search in searches.by_method.values() for found in search.best}
    for found in chosen([search.best for search in searches.by_method.values()], request):
        start = time.process_time()
        grasps.append(to_grasp(body, request.friction, searches.as_found(found)))
        owner[id(found)].seconds += time.process_time() - start
    counts = PlanCounts(
        len(body.faces),
        searches.quadruples,
        count_spanning(body.normals, LEAST_SPAN_ANGLE) if len(body.faces) <= MAX_FACES else None,
        {method: search.counts for method, search in searches.by_method.items()},
    )
    outcomes, whole = searches.outcomes(), searches.whole_faces
    every = searches.by_method.values()
    return Plan(
        grasps=tuple(grasps),
        friction=request.friction,
        theta=request.theta,
        seed=request.seed,
        counts=counts,
        outcomes=outcomes,
        absence=None if grasps else _absence(body, request, counts, outcomes),
        absences={faces: proofs for s in every for faces, proofs in searches.absences(s).items()},
        finger=request.finger,
        undecided={whole(faces): share for s in every for faces, share in s.undecided.items()},
        unreached={whole(faces): why for faces, why in searches.unreached().items()},
        seconds={method: search.seconds for method, search in searches.by_method.items()},
    )


def _absence(body: Polyhedron, request: PlanRequest, counts: PlanCounts, outcomes: Outcomes) -> str:
    """Why there is no grasp, as a sentence."""
    name = body.name
    if outcomes.out_of_reach:
        return (
            f"{name}: no grasp was found that the fingers reach, on {outcomes.out_of_reach} of "
            f"{counts.quadruples} face quadruples for want of room; try a smaller fingertip radius "
            "or a shorter approach"
        )
    if "free" in counts.families and body.patches:
        return f"{name}: no grasp was found on its patches, which proves nothing about others"
    if "free" in counts.families:
        limits = f" at friction {math.tan(request.theta):.4g}"
        if request.clearance:
            limits += f" on faces cut back by {request.clearance:g} m from their edges"
        if outcomes.open:
            return (
                f"{name}: no grasp was found; {outcomes.open} of {counts.quadruples} face "
                f"quadruples are undecided, all others are proved to hold none{limits}; try "
                "--complete"
            )
        return (
            f"{name}: each of {counts.quadruples} face quadruples is proved to hold no "
            f"grasp{limits}"
        )
    if request.cones == "normal" and counts.spanning == 0:
        return (
            f"{name} has no four faces whose normals keep positively spanning space when each "
            "may tilt within a force cone (P3; no box or prism has), so the paper's "
            "constructions offer no grasp; tilted cones or the free method may"
        )
    spanning = (
        f"{counts.spanning} face quadruples span (P3), but "
        if request.cones == "normal" and counts.spanning is not None
        else ""
    )
    return (
        f"{name}: {spanning}no {' or '.join(counts.families)} grasp was found, which is no proof "
        f"that there is none (discs below {LEAST_RADIUS:g} object radii do not count); the free "
        "method may find others (--family free)"
    )
