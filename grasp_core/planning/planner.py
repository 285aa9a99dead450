"""Plans certified four-finger grasps for an object and a friction coefficient.

The three constructions of the paper work on quadruples with force cones that positively span (P3),
around the normals or tilted, in the order of an upper bound on their radius. With a `limit`, a
search ends when the bound falls below the worst radius kept, so the grasps returned are the best
ones and not merely some. The free method goes through the quadruples that no construction holds,
and finds grasps on them or proves that there are none.
"""

import math
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import nullcontext
from functools import partial
from typing import cast

from grasp_core.cones.spanning import count_spanning
from grasp_core.families.placements import LEAST_RADIUS
from grasp_core.frames import kept_angle
from grasp_core.kinds import Count, function, value_of
from grasp_core.names import METHODS, ConeKind, Method, RankBy
from grasp_core.objects.planar_faces import MAX_FACES
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.planning.certify import Certified, absence_as_given, faces_as_given, to_grasp
from grasp_core.planning.plan_search import PlanSearch, Progress, chosen, worth_starting
from grasp_core.planning.quadruples import LEAST_SPAN_ANGLE
from grasp_core.planning.reach import Finger
from grasp_core.planning.result import Ended, Outcomes, Plan, PlanCounts, PlanRequest, check_request
from grasp_core.processes import local_processes
from grasp_core.stopping import Stop
from grasp_core.values import Grasp


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
    max_face_parts: int = 1,
    complete: bool = False,
    finger: Finger | None = None,
    edge_clearance_m: float = 0.0,
    share_faces_m: float | None = None,
    time_limit_s: float | None = None,
    progress: Progress | None = None,
    jobs: int = 1,
) -> Plan:
    """Find the four-finger force-closure grasps of an object.

    Args:
        body: The object.
        friction: Coulomb coefficient at every contact.
        families: Methods to try: constructions of the paper, and `free`, the method without a fixed
            type. Beside constructions `free` gets the quadruples that they leave over.
        theta_deg: Half-angle of the friction cones to plan with [deg]; atan(friction) when
            None, and never more than that.
        cones: `normal` keeps force cones around the normals, as in the paper; `tilted` also tries
            cones that lean away from the normals.
        limit: Keep at most this many grasps, the best ones.
        rank_by: What makes a grasp better. By `radius`, families take turns, each with its largest
            discs first. Reguli and free grasps have no discs: the first ones found count, and free
            ones only if the others are too few. By `friction-margin` (the least critical
            friction), `ferrari-canny` (the largest quality), `payload` (the largest mass in any
            orientation under one squeeze with pushes up to 10 N; grasps that no such squeeze holds
            come last), `placement` (the largest proved chance of closure where the object is off by
            2 mm and 2 degrees, see `placement_probability`; those without a bound come last, and
            `Plan.unranked` says why) and `diverse` (each next one is the farthest from those before
            it) all grasps that are found compete. For objects with a radius below 25 mm, the 2 mm
            are as much less as the radius, the 10 N as its square.
        seed: Seed of the free method's restarts.
        max_face_parts: Most parts into which the free method may cut the faces of one quadruple.
        complete: Decide the quadruples that would stay undecided, with up to 20,000 parts each.
        finger: Keep only grasps that such fingers reach on straight free lines.
        edge_clearance_m: Distance of contacts and their regions from all edges of their faces [m].
            Faces are cut back by this much, by somewhat more at corners that turn inwards; absence
            is then proved for what is left of the faces.
        share_faces_m: Let two fingers stand on one face, at least this far apart [m]; each face is
            cut once for that, across its longest direction.
        time_limit_s: Time after which planning ends with what is found by then, within some
            seconds [s]. `Plan.ended` then says so: a clock decided which grasps are in the plan.
        progress: Called after each quadruple that is tried.
        jobs: Largest number of processes. Only searches for all grasps of objects with many faces
            use more than one; the plan does not depend on it, except for `Plan.seconds`.

    Returns:
        The certified grasps, the best first, or a sentence why there are none, with counts.

    Raises:
        InputError: An argument is out of range, or the object has too many faces.
        SolverError: A program was neither solved nor proved infeasible.
    """
    request = PlanRequest(
        friction, _listed(families), theta_deg, cones, limit, rank_by, max_face_parts, complete,
        edge_clearance_m, share_faces_m, seed, time_limit_s, finger,
    )  # fmt: skip
    if progress is not None:
        function(progress, "progress")
    jobs = value_of(Count, jobs, "jobs")
    return search_plan(body, request, Stop(seconds=request.time_limit_s), progress, jobs=jobs)


MADE_S = 2e-4
"""Time in which a grasp that is found is put into the object's frame [s]."""


def search_plan(
    body: Polyhedron, request: PlanRequest, stop: Stop, progress: Progress | None = None,
    ranked: Callable[[int, int], None] | None = None, jobs: int = 1, after_s: float = MADE_S,
) -> Plan:  # fmt: skip
    """Plan what is requested, until told to stop; `ranked` is called with (ranked, to be ranked).

    The time limit of the request does not count: `stop` does, which phases after it may share. The
    search leaves the time `after_s` for each grasp of the plan [s].
    """
    check_request(body, request)
    # other rankings measure every grasp that is found, and need time of their own
    searching = stop.part(1 if request.rank_by == "radius" else 2)
    most = math.inf if request.limit is None else request.limit
    others = worth_starting(body, request, jobs)
    with local_processes(others) if others else nullcontext() as workers:
        search = PlanSearch.of(body, request, workers, searching)
        for found, _ in enumerate(search.run(progress)):
            if found < most:
                searching.reserve(after_s)
    cut = searching()
    best = chosen(search, stop, ranked)
    ended = searching.why if cut or (stop() and request.rank_by != "radius") else "done"
    return _planned(search, best, ended)


def iter_grasps(  # noqa: PLR0913 - as `plan`
    body: Polyhedron,
    friction: float = 0.5,
    *,
    families: Sequence[Method] | Method = METHODS,
    theta_deg: float | None = None,
    cones: ConeKind = "tilted",
    seed: int = 0,
    max_face_parts: int = 1,
    finger: Finger | None = None,
    edge_clearance_m: float = 0.0,
    share_faces_m: float | None = None,
) -> Iterator[Grasp]:
    """Like `plan`, but yields each grasp as soon as it is certified, in no particular order.

    Raises:
        InputError: An argument is out of range, or the object has too many faces.
        SolverError: A program was neither solved nor proved infeasible.
    """
    request = PlanRequest(
        friction, _listed(families), theta_deg, cones, seed=seed, max_face_parts=max_face_parts,
        finger=finger, edge_clearance_m=edge_clearance_m, share_faces_m=share_faces_m,
    )  # fmt: skip
    check_request(body, request)
    search = PlanSearch.of(body, request)
    return (to_grasp(body, friction, each, search.on) for each in search.run())


def _listed(families: Sequence[Method] | Method) -> tuple[Method, ...]:
    """Return methods as a tuple, also a single one; `PlanRequest` checks them."""
    return (families,) if isinstance(families, str) else cast("tuple[Method, ...]", families)


CUT_SHORT = (
    "no grasp was found before the search was ended, which proves nothing; give it more time "
    "(--time-limit-s), or fewer faces (--faces patches)"
)
"""Why a plan that a clock or an interrupt ended has no grasp."""


def _planned(search: PlanSearch, best: Sequence[Certified], ended: Ended) -> Plan:
    """Put together a plan from what a search found, with the best grasps."""
    body, on, request, methods = search.body, search.on, search.request, search.methods
    start = time.process_time()
    grasps = tuple(to_grasp(body, request.friction, found, on) for found in best)
    per_grasp = (time.process_time() - start) / max(len(best), 1)
    for method, count in Counter[Method](found.method for found in best).items():
        methods[method].seconds += count * per_grasp
    counts = PlanCounts(
        len(body.faces),
        on.quadruples,
        count_spanning(body.normals, LEAST_SPAN_ANGLE) if len(body.faces) <= MAX_FACES else None,
        {method: each.counts for method, each in methods.items()},
    )
    known, every = search.outcomes, methods.values()
    absence = CUT_SHORT if ended != "done" else _absence(body, request, counts, known)
    given = partial(faces_as_given, on=on)
    return Plan(
        body=body,
        grasps=grasps,
        friction=request.friction,
        theta=kept_angle(request.theta),
        seed=request.seed,
        counts=counts,
        outcomes=known,
        ended=ended,
        absence=None if grasps else absence,
        absences={
            given(faces): tuple(absence_as_given(proof, on) for proof in proofs)
            for each in every
            for faces, proofs in each.gathered.absences.items()
        },
        finger=request.finger,
        undecided={
            given(faces): share
            for each in every
            for faces, share in each.gathered.undecided.items()
        },
        unreached={given(faces): why for faces, why in search.unreached.items()},
        unranked=dict(search.unranked),
        seconds={method: each.seconds for method, each in methods.items()},
    )


def _absence(body: Polyhedron, request: PlanRequest, counts: PlanCounts, known: Outcomes) -> str:
    """Why there is no grasp, as a sentence with the object's name."""
    name = body.name
    if known.out_of_reach:
        return (
            f"{name}: no grasp was found that the fingers reach, on {known.out_of_reach} of "
            f"{counts.quadruples} face quadruples for want of room; try a smaller fingertip radius "
            "or a shorter approach"
        )
    if "free" in counts.families and body.patches:
        return f"{name}: no grasp was found on its patches, which proves nothing about others"
    if "free" in counts.families:
        limits = f" at friction {math.tan(request.theta):.4g}"
        if request.edge_clearance_m:
            limits += f" on faces cut back by {request.edge_clearance_m:g} m from their edges"
        if known.open:
            return (
                f"{name}: no grasp was found; {known.open} of {counts.quadruples} face "
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
        "method may find others (--families free)"
    )
