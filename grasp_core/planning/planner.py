"""Plans certified four-finger grasps for an object and a friction coefficient.

The three constructions of the paper work on quadruples with force cones that positively span (P3),
around the normals or tilted, in the order of an upper bound on their radius. With a `limit`, a
search ends when the bound falls below the worst radius kept, so the grasps returned are the best
ones and not merely some. The free method goes through the quadruples that no construction holds,
and finds grasps on them or proves that there are none.
"""

import math
import time
import warnings
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import nullcontext
from functools import partial
from typing import Any

from grasp_core.allowed_values import Count, function, instance, value_of
from grasp_core.cones.spanning import count_spanning
from grasp_core.errors import InputError
from grasp_core.families.placements import LEAST_RADIUS
from grasp_core.frames import kept_angle
from grasp_core.names import Method, RankBy
from grasp_core.objects.planar_faces import MAX_FACES
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.planning.certify import Certified, absence_as_given, faces_as_given, to_grasp
from grasp_core.planning.plan_search import PlanProgress, PlanSearch, chosen, worth_starting
from grasp_core.planning.quadruples import LEAST_SPAN_ANGLE
from grasp_core.planning.reach import Finger
from grasp_core.planning.result import Outcomes, Plan, PlanCounts, PlanRequest, check_request
from grasp_core.planning.settings import PlanSettings
from grasp_core.processes import local_processes
from grasp_core.settings import extended
from grasp_core.stopping import Stop
from grasp_core.time_spent import TIME_SPENT
from grasp_core.values import Grasp


def plan(  # noqa: PLR0913 - the five settings that most plans need are keywords too
    body: Polyhedron,
    friction: float | None = None,
    *,
    families: Sequence[Method] | Method | None = None,
    limit: int | None = None,
    rank_by: RankBy | None = None,
    finger: Finger | None = None,
    settings: PlanSettings | None = None,
    progress: PlanProgress | None = None,
    jobs: int = 1,
    **deprecated: Any,
) -> Plan:
    """Find the four-finger force-closure grasps of an object.

    Args:
        body: The object.
        friction: Coulomb coefficient at every contact. For this and the next three arguments, None
            takes what `settings` say.
        families: Methods to try: constructions of the paper, and `free`, the method without a fixed
            type. Beside constructions `free` gets the quadruples that they leave over.
        limit: Keep at most this many grasps, the best ones.
        rank_by: What the best grasps have, by the names of `grasp_core.names.RANKINGS`. By
            `radius`, families take turns, each with its largest discs first. Reguli and free grasps
            have no discs: the first ones found count, and free ones only if the others are too few.
            By the other rankings all grasps that are found compete; those without a figure come
            last, and `Plan.unranked` says why.
        finger: Keep only grasps that such fingers reach on straight free lines.
        settings: All settings of the plan; the usual ones if None.
        progress: Called after each quadruple that is tried.
        jobs: Largest number of processes. Only searches for all grasps of objects with many faces
            use more than one; the plan does not depend on it, except for `Plan.seconds`.
        deprecated: Other settings by their names, which `settings` takes now.

    Returns:
        The certified grasps, the best first, or a sentence why there are none, with counts.

    Raises:
        InputError: An argument is out of range, or the object has too many faces.
        SolverError: A program was neither solved nor proved infeasible.
    """
    given = {
        "friction": friction, "families": families, "limit": limit, "rank_by": rank_by,
        "finger": finger,
    }  # fmt: skip
    request = requested("plan", settings, given, deprecated)
    check_request(body, request)
    if progress is not None:
        function(progress, "progress")
    jobs = value_of(Count, jobs, "jobs")
    stop = Stop(seconds=request.time_limit_s)
    search = search_grasps(body, request, stop, progress, jobs=jobs)
    best = chosen(search, stop)
    return put_together(search, best)


def iter_grasps(
    body: Polyhedron,
    friction: float | None = None,
    *,
    families: Sequence[Method] | Method | None = None,
    finger: Finger | None = None,
    settings: PlanSettings | None = None,
    **deprecated: Any,
) -> Iterator[Grasp]:
    """Like `plan`, but yields each grasp as soon as it is certified, in no particular order.

    Raises:
        InputError: An argument is out of range, `settings` ask for the best grasps, by a limit or a
            ranking, or the object has too many faces.
        SolverError: A program was neither solved nor proved infeasible.
    """
    given = {"friction": friction, "families": families, "finger": finger}
    request = requested("iter_grasps", settings, given, deprecated)
    if request.limit is not None or request.rank_by != "radius":
        raise InputError(
            "iter_grasps: settings.limit and settings.rank_by choose the best of all grasps, which "
            "come in no order here; leave them out, or use plan"
        )
    check_request(body, request)
    search = PlanSearch.of(body, request, stop=Stop(seconds=request.time_limit_s))
    return (to_grasp(body, request.friction, each, search.on) for each in search.run())


def requested(
    name: str, settings: PlanSettings | None, given: Mapping[str, Any], old: Mapping[str, Any]
) -> PlanRequest:
    """Make a request of settings, of keywords that are not None, and of `old` ones with a warning.

    The caller of the function `name`, which calls this one, is warned.
    """
    if settings is None:
        settings = PlanSettings()
    instance(settings, PlanSettings, "settings")
    for word, value in old.items():
        if word not in DEPRECATED:
            raise TypeError(f"{name}() got an unexpected keyword argument {word!r}")
        warnings.warn(
            f"{name}({word}=...) will go; write settings=PlanSettings({word}={value!r})",
            DeprecationWarning, stacklevel=3,
        )  # fmt: skip
    more = {word: value for word, value in given.items() if value is not None} | dict(old)
    if isinstance(more.get("families"), str):
        more["families"] = (more["families"],)
    return extended(PlanRequest, settings, **more)


DEPRECATED = (
    "theta_deg", "cones", "seed", "max_face_parts", "complete", "edge_clearance_m",
    "share_faces_m", "time_limit_s",
)  # fmt: skip
MADE_S = 2e-4
"""Time in which a grasp that is found is put into the object's frame [s]."""


@TIME_SPENT.on("planning")
def search_grasps(
    body: Polyhedron, request: PlanRequest, stop: Stop, progress: PlanProgress | None = None,
    *, jobs: int = 1, after_s: float = MADE_S,
) -> PlanSearch:  # fmt: skip
    """Search for all grasps that are requested, until told to stop.

    The time limit of the request does not count: `stop` does, which phases after it may share. The
    search leaves the time `after_s` for each grasp of the plan [s].
    """
    # other rankings measure every grasp that is found, and need time of their own
    searching = stop.part(1 if request.rank_by == "radius" else 2)
    most = math.inf if request.limit is None else request.limit
    others = worth_starting(body, request, jobs)
    with local_processes(others) if others else nullcontext() as workers:
        search = PlanSearch.of(body, request, workers, searching)
        for found, _ in enumerate(search.run(progress)):
            if found < most:
                searching.reserve(after_s)
    if searching():
        search.ended = searching.why
    return search


CUT_SHORT = (
    "no grasp was found before the search was ended, which proves nothing; give it more time "
    "(--time-limit-s), or fewer faces (--faces patches)"
)
"""Why a plan that a clock or an interrupt ended has no grasp."""


def put_together(search: PlanSearch, best: Sequence[Certified]) -> Plan:
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
    absence = CUT_SHORT if search.ended != "done" else _absence(body, request, counts, known)
    given = partial(faces_as_given, on=on)
    return Plan(
        body=body,
        grasps=grasps,
        friction=request.friction,
        theta=kept_angle(request.theta),
        seed=request.seed,
        counts=counts,
        outcomes=known,
        ended=search.ended,
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
