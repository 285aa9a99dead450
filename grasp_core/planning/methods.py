"""Runs the requested planning methods on one object, and collects their grasps and counts."""

import math
import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import chain, islice
from typing import TypeAlias

from grasp_core.families.placing import CONSTRUCTIONS
from grasp_core.kinds import METHODS, Family, Method
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.objects.standard_order import Standard
from grasp_core.planning.certify import Certified
from grasp_core.planning.family_search import MethodSearch
from grasp_core.planning.parts import (
    Block,
    Elsewhere,
    Object,
    in_standard_order,
    search_batches,
    search_blocks,
    search_family,
    search_undecided,
)
from grasp_core.planning.reach import Finger, Reach, reach
from grasp_core.planning.request import FAMILIES, PlanRequest
from grasp_core.planning.result import Outcomes
from grasp_core.values import FINGERS, FaceQuadruple

Progress: TypeAlias = Callable[[int, int, int], None]
"""Called with (quadruples finished, all quadruples, grasps so far) after each quadruple tried."""
Searches: TypeAlias = dict[Method, MethodSearch]
"""The search of each method that is asked for; the free method comes last."""


def prepared(body: Polyhedron, request: PlanRequest) -> tuple[Standard, Searches]:
    """Put an object into standard order, with faces cut as requested, and set up its searches."""
    on = in_standard_order(body, request)
    reached = partial(_reach, on.body, request.finger)
    methods: list[Method] = [method for method in METHODS if method in request.families]
    return on, {method: MethodSearch(method, request.searched, reached) for method in methods}


def _reach(body: Polyhedron, finger: Finger | None, found: Certified) -> Reach:
    """How fingers get to the contacts; nothing is sought where no finger is given."""
    if finger is None:
        return Reach(None)
    positions = body.center_of_mass + body.radius * found.placement.positions
    return reach(body, found.faces, positions, found.normals, finger)


def run(
    on: Standard,
    request: PlanRequest,
    searches: Searches,
    progress: Progress | None,
    elsewhere: Elsewhere | None = None,
) -> Iterator[Certified]:
    """Yield each certified grasp in the order of the searches, on the standard object."""
    total, found = len(searches) * on.quadruples, 0
    for done, grasps in _steps(Object(on, request, elsewhere), searches):
        found += len(grasps)
        if progress is not None:
            progress(done, total, found)
        yield from grasps
    if progress is not None:
        progress(total, total, found)


def _steps(work: Object, searches: Searches) -> Iterator[tuple[int, list[Certified]]]:
    """Yield, for each quadruple tried, how many are finished at least, and its grasps.

    With a limit, only grasps that are among the best when they are found.
    """
    on, limit, dealt_with, kept_so_far = work.on, work.request.searched, 0, list[int]()
    families: list[Family] = [family for family in FAMILIES if family in searches]
    parts = {
        family: [Block(family, place) for place in range(len(work.blocks(family)[0]))]
        for family in families
        if limit is None
    }
    found = work.each_found(chain.from_iterable(parts.values()))
    for family in families:
        search = searches[family]
        if limit is None:
            steps = search_blocks(islice(found, len(parts[family])), search)
        else:
            search.limit = _share(limit, kept_so_far)
            steps = search_family(work, family, search)
        yield from enumerate(_timed(steps, search), start=dealt_with + 1)
        _prune(family, search, on.quadruples)
        kept_so_far.append(len(search.best))
        dealt_with += on.quadruples
    if "free" in searches:
        search, held = searches["free"], _held(searches)
        if limit is not None:
            search.limit = max(limit - sum(kept_so_far), 0)
        steps = search_batches(work, search, held)
        yield from enumerate(_timed(steps, search), start=dealt_with + 1)
        _prune("free", search, on.quadruples)
        if work.request.complete:
            for grasps in _timed(search_undecided(work, search), search):
                yield dealt_with + on.quadruples, grasps


def _held(searches: Searches) -> set[FaceQuadruple]:
    """Quadruples on which a grasp was found."""
    return set[FaceQuadruple]().union(*(search.held for search in searches.values()))


def _prune(method: Method, search: MethodSearch, quadruples: int) -> None:
    """Count what was not tried; each quadruple counts once per order of the fingers."""
    orders = 1 if method == "free" else len(CONSTRUCTIONS[method].orders)
    tally = search.gathered.tally
    tally["pruned"] = quadruples * orders - tally["tried"]


def _share(limit: int, before: Sequence[int]) -> int:
    """Most grasps that a construction can keep, given how many the constructions before it found.

    Families take turns. If all earlier ones but k run out, with n_1, n_2, .. grasps, this one
    gets at most every (k + 1)-th grasp of what they leave.
    """
    found = sorted(before)
    left = [limit - sum(found[:short]) for short in range(len(found) + 1)]
    return max(each // (len(found) - short + 1) for short, each in enumerate(left))


def outcomes(on: Standard, searches: Searches) -> Outcomes:
    """Counts of how the quadruples ended: held, absent, open or out of reach."""
    held = _held(searches)
    absences = set[FaceQuadruple]().union(
        *(search.gathered.absences for search in searches.values())
    )
    # patches leave parts of the surface out, so a patch without room proves nothing
    absent = len(absences) + (0 if on.body.patches else _without_room(on))
    out_of_reach = len(unreached(searches))
    undecided = on.quadruples - len(held) - absent - out_of_reach
    return Outcomes(len(held), absent, undecided, out_of_reach)


def unreached(searches: Searches) -> dict[FaceQuadruple, str]:
    """Quadruples with contacts, none of which fingers reach, and why not the last ones."""
    every = searches.values()
    known = _held(searches).union(*(search.gathered.absences for search in every))
    return {
        faces: why
        for search in every
        for faces, why in search.unreached.items()
        if faces not in known
    }


def _without_room(on: Standard) -> int:
    """Number of quadruples with a face that has no room for a contact."""
    whole = len(on.faces)
    roomy = sum(shape is not None for shape in on.shapes[:whole])
    shared = sum(any(on.shapes[face] is None for face in faces) for faces in on.shared.tolist())
    return math.comb(whole, FINGERS) - math.comb(roomy, FINGERS) + shared


def _timed(steps: Iterator[list[Certified]], search: MethodSearch) -> Iterator[list[Certified]]:
    """Yield each of `steps`, adding the processor time it took to `search.seconds`."""
    while True:
        start = time.process_time()
        step = next(steps, None)
        search.seconds += time.process_time() - start
        if step is None:
            return
        yield step
