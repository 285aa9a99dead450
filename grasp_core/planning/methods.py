"""Runs the requested planning methods on one object, and collects their grasps and counts."""

import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import TypeAlias

from grasp_core.families.constructions import CONSTRUCTIONS
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.objects.standard_order import Standard, standard
from grasp_core.objects.trimmed_faces import clear_of_edges, with_halves
from grasp_core.planning.blocks import Blocks, all_blocks, kept, spanning_blocks
from grasp_core.planning.certify import Certified
from grasp_core.planning.family_search import MethodSearch, search_construction
from grasp_core.planning.free_search import search_free, search_undecided
from grasp_core.planning.planned_cones import PlannedCones
from grasp_core.planning.reach import Finger, Reach, reach
from grasp_core.planning.request import FAMILIES, METHODS, PlanRequest
from grasp_core.planning.result import Outcomes
from grasp_core.values import FINGERS, FaceQuadruple, Family, Method

KEPT_BLOCKS = 8
"""Number of blocks of face quadruples kept for all families: some hundred megabytes."""
Progress: TypeAlias = Callable[[int, int, int], None]
"""Called with (quadruples finished, all quadruples, grasps so far) after each quadruple tried."""
Searches: TypeAlias = dict[Method, MethodSearch]
"""The search of each method that is asked for; the free method comes last."""


def prepared(body: Polyhedron, request: PlanRequest) -> tuple[Standard, Searches]:
    """Put an object into standard order, with faces cut as requested, and set up its searches."""
    on = standard(body)
    if request.clearance:
        on = replace(on, body=clear_of_edges(on.body, request.clearance))
    if request.share_faces is not None:
        halved, owners = with_halves(on.body, request.share_faces)
        on = replace(on, body=halved, owners=owners)
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
    on: Standard, request: PlanRequest, searches: Searches, progress: Progress | None
) -> Iterator[Certified]:
    """Yield each certified grasp in the order of the searches, on the standard object."""
    total, found = len(searches) * on.quadruples, 0
    for done, grasps in _steps(on, request, searches):
        found += len(grasps)
        if progress is not None:
            progress(done, total, found)
        yield from grasps
    if progress is not None:
        progress(total, total, found)


def _steps(
    on: Standard, request: PlanRequest, searches: Searches
) -> Iterator[tuple[int, list[Certified]]]:
    """Yield, for each quadruple tried, how many are finished at least, and its grasps."""
    families: list[Family] = [family for family in FAMILIES if family in searches]
    around_normals, every = _blocks(on, request)
    dealt_with, limit = 0, request.searched
    kept_so_far: list[int] = []
    for family in families:
        construction, search = CONSTRUCTIONS[family], searches[family]
        search.limit = None if limit is None else _share(limit, kept_so_far)
        # without bounds on discs, only cones around the normals are used
        blocks = around_normals if construction.limits is None else every
        steps = search_construction(construction, on.shapes, request.friction, blocks, search)
        yield from enumerate(_timed(steps, search), start=dealt_with + 1)
        # each quadruple counts once per order of the fingers
        search.tally.prune(on.quadruples * len(construction.orders))
        kept_so_far.append(len(search.best))
        dealt_with += on.quadruples
    if "free" in searches:
        search = searches["free"]
        search.limit = None if limit is None else max(limit - sum(kept_so_far), 0)
        held = set[FaceQuadruple]().union(*(each.held for each in searches.values()))
        steps = search_free(on, request, search, held)
        yield from enumerate(_timed(steps, search), start=dealt_with + 1)
        search.tally.prune(on.quadruples)
        if request.complete:
            for grasps in _timed(search_undecided(on, request, search), search):
                yield dealt_with + on.quadruples, grasps


def _blocks(on: Standard, request: PlanRequest) -> tuple[Blocks, Blocks]:
    """Blocks with cones around the normals, and blocks with all cones that may be used."""
    whole = len(on.faces)
    cones = PlannedCones(on.body, on.shapes, request.theta, tilted=False)
    around_normals = kept(spanning_blocks(cones, whole), KEPT_BLOCKS)
    if request.cones == "normal":
        return around_normals, around_normals
    cones = replace(cones, tilted=True)
    return around_normals, kept(all_blocks(cones, whole, on.shared), KEPT_BLOCKS)


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
    held = set[FaceQuadruple]().union(*(search.held for search in searches.values()))
    absences = set[FaceQuadruple]().union(*(search.absences for search in searches.values()))
    # patches leave parts of the surface out, so a patch without room proves nothing
    absent = len(absences) + (0 if on.body.patches else _without_room(on))
    out_of_reach = len(unreached(searches))
    undecided = on.quadruples - len(held) - absent - out_of_reach
    return Outcomes(len(held), absent, undecided, out_of_reach)


def unreached(searches: Searches) -> dict[FaceQuadruple, str]:
    """Quadruples with contacts, none of which fingers reach, and why not the last ones."""
    every = searches.values()
    known = set[FaceQuadruple]().union(*(search.held for search in every))
    known = known.union(*(search.absences for search in every))
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
