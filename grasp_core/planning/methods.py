"""Runs the methods over the face quadruples of one object, and adds up what they found."""

import math
import time
from collections.abc import Callable, Iterator
from itertools import combinations, islice
from typing import TypeAlias

from grasp_core.families.constructions import CONSTRUCTIONS, MIXED, Construction
from grasp_core.families.free import Absence
from grasp_core.objects.face_pieces import face_shapes
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.objects.standard_order import standard
from grasp_core.objects.trimmed_faces import clear_of_edges, shared_quadruples, with_halves
from grasp_core.planning.as_given import Place, absence_as_given, as_given
from grasp_core.planning.blocks import Blocks, all_blocks, spanning_blocks
from grasp_core.planning.certify import Certified
from grasp_core.planning.family_search import MethodSearch, search_construction
from grasp_core.planning.free_search import FreeRequest, search_free, search_undecided
from grasp_core.planning.planned_cones import PlannedCones
from grasp_core.planning.reach import Reach, reach
from grasp_core.planning.request import COMPLETE_PARTS, FAMILIES, METHODS, PlanRequest
from grasp_core.planning.result import Outcomes
from grasp_core.values import FINGERS, FaceQuadruple, Family, Method, four

KEPT_BLOCKS = 8
"""Number of blocks made once for all families and kept: they take some hundred megabytes."""
Progress: TypeAlias = Callable[[int, int, int], None]
"""Called with (quadruples finished, all quadruples, grasps so far) after each quadruple tried."""


class Searches:
    """The searches of one plan, one per method; the free method goes last."""

    def __init__(self, body: Polyhedron, request: PlanRequest) -> None:
        self.request = request
        self.standard = standard(body)
        self.body = self.standard.body
        if request.clearance:
            self.body = clear_of_edges(self.body, request.clearance)
        self.owners = tuple(range(len(body.faces)))
        if request.share_faces is not None:
            self.body, self.owners = with_halves(self.body, request.share_faces)
        self.shapes = face_shapes(self.body)
        self.shared = shared_quadruples(self.owners)
        self.quadruples = math.comb(len(body.faces), FINGERS) + len(self.shared)
        self.by_method: dict[Method, MethodSearch] = {
            method: MethodSearch(method, request.searched, self._reach)
            for method in METHODS
            if method in request.families
        }
        self.whole = len(body.faces)
        of_object = self.body, self.shapes, request.theta
        around = PlannedCones(*of_object, tilted=False)
        self.spanning_blocks = spanning_blocks(around, self.whole).keeping(KEPT_BLOCKS)
        self.tilted_blocks = self.spanning_blocks
        if request.cones == "tilted":
            tilted = PlannedCones(*of_object, tilted=True)
            self.tilted_blocks = all_blocks(tilted, self.whole, self.shared).keeping(KEPT_BLOCKS)

    @property
    def constructions(self) -> dict[Family, MethodSearch]:
        """The searches of the paper's three families, as far as they are asked for."""
        return {family: self.by_method[family] for family in FAMILIES if family in self.by_method}

    @property
    def held(self) -> set[FaceQuadruple]:
        """Ascending faces of every quadruple on which a family has a grasp."""
        return set[FaceQuadruple]().union(*(search.held for search in self.constructions.values()))

    def run(self, progress: Progress | None) -> Iterator[Certified]:
        """Yield each certified grasp in the order of the search, on the standard object."""
        total, found = len(self.by_method) * self.quadruples, 0
        for done, grasps in self._steps():
            found += len(grasps)
            if progress is not None:
                progress(done, total, found)
            yield from grasps
        if progress is not None:
            progress(total, total, found)

    def _steps(self) -> Iterator[tuple[int, list[Certified]]]:
        """Yield, for each quadruple tried, how many are finished at least, and its grasps."""
        for place, (method, search) in enumerate(self.constructions.items()):
            construction, dealt_with = CONSTRUCTIONS[method], place * self.quadruples
            search.limit = self._share(place)
            steps = search_construction(
                construction, self.shapes, self.request.friction,
                self._blocks(construction), search,
            )  # fmt: skip
            yield from enumerate(_timed(steps, search), start=dealt_with + 1)
            # each quadruple counts once per order of the fingers
            every = self.quadruples * len(construction.orders)
            search.tally.prune(every)
        if "free" in self.by_method:
            search = self.by_method["free"]
            search.limit = self._left()
            dealt_with = len(self.constructions) * self.quadruples
            request = self._free_request()
            steps = search_free(self.shapes, self._every(), request, search, self.held)
            yield from enumerate(_timed(steps, search), start=dealt_with + 1)
            search.tally.prune(self.quadruples)
            if self.request.complete:
                request = self._free_request(COMPLETE_PARTS)
                steps = search_undecided(self.shapes, request, search)
                for found in _timed(steps, search):
                    yield dealt_with + self.quadruples, found

    def _every(self) -> Iterator[FaceQuadruple]:
        """All quadruples of faces; the ones with two halves of a face come last."""
        yield from combinations(range(self.whole), FINGERS)
        for faces in self.shared.tolist():
            yield four(faces)

    def _left(self) -> int | None:
        """How many grasps the constructions leave for the free method to find."""
        if self.request.searched is None:
            return None
        found = sum(len(search.best) for search in self.constructions.values())
        return max(self.request.searched - found, 0)

    def _share(self, place: int) -> int | None:
        """Most grasps that a construction can keep, given what the constructions before it found.

        Families take turns. If all earlier ones but k run out, with n_1, n_2, .. grasps, this one
        gets at most every (k + 1)-th grasp of what they leave.
        """
        limit = self.request.searched
        if limit is None:
            return None
        found = sorted(len(search.best) for search in islice(self.by_method.values(), place))
        left = [limit - sum(found[:short]) for short in range(place + 1)]
        return max(each // (place - short + 1) for short, each in enumerate(left))

    def _blocks(self, construction: Construction) -> Blocks:
        """Blocks of quadruples for one construction.

        A construction without bounds on discs uses only cones around the normals.
        """
        return self.spanning_blocks if construction.limits is None else self.tilted_blocks

    def _free_request(self, max_face_parts: int | None = None) -> FreeRequest:
        request = self.request
        structured = [CONSTRUCTIONS[method] for method in self.constructions]
        upgrades = [each for each in structured if each.limits and request.cones == "tilted"]
        upgrades += [MIXED for each in upgrades if each.family == MIXED.family]
        return FreeRequest(
            request.friction, request.theta, request.seed,
            max_face_parts or request.max_face_parts, upgrades, self.owners,
        )  # fmt: skip

    def _reach(self, found: Certified) -> Reach:
        """How fingers get to the contacts; nothing is sought where no finger is given."""
        finger = self.request.finger
        if finger is None:
            return Reach(None)
        positions = self.body.center_of_mass + self.body.radius * found.placement.positions
        return reach(self.body, found.faces, positions, found.normals, finger)

    def whole_faces(self, faces: FaceQuadruple) -> FaceQuadruple:
        """Ascending faces of the object as given, where halves count as their whole faces."""
        return four(sorted(self.standard.faces[self.owners[face]] for face in faces))

    def as_found(self, found: Certified) -> Certified:
        """Translate a grasp to the object as given; half faces are named by `a` and `b`."""
        first = {owner: index for index, owner in reversed(list(enumerate(self.owners)))
                 if index != owner}  # fmt: skip
        owners = [self.owners[face] for face in found.faces]
        halves = [
            "" if face == owner else "a" if face == first[owner] else "b"
            for face, owner in zip(found.faces, owners, strict=True)
        ]
        places = [
            Place(self.standard.faces[owner], half)
            for owner, half in zip(owners, halves, strict=True)
        ]
        return as_given(found, places, mirrored=self.standard.mirrored)

    def absences(self, search: MethodSearch) -> dict[FaceQuadruple, tuple[Absence, ...]]:
        """Proofs of absence found by a search, translated to the object as it was given."""
        return {
            self.whole_faces(faces): tuple(
                absence_as_given(proof, self.standard, self.owners) for proof in proofs
            )
            for faces, proofs in search.absences.items()
        }

    def outcomes(self) -> Outcomes:
        """Counts of how the quadruples ended: held, absent, open or out of reach."""
        searches = list(self.by_method.values())
        held = set[FaceQuadruple]().union(*(search.held for search in searches))
        absences = set[FaceQuadruple]().union(*(search.absences for search in searches))
        # patches leave parts of the surface out, so a patch without room proves nothing
        absent = len(absences) + (0 if self.body.patches else self._without_room())
        out_of_reach = len(self.unreached())
        undecided = self.quadruples - len(held) - absent - out_of_reach
        return Outcomes(len(held), absent, undecided, out_of_reach)

    def unreached(self) -> dict[FaceQuadruple, str]:
        """Quadruples with contacts, none of which fingers reach, and why not the last ones."""
        searches = list(self.by_method.values())
        known = set[FaceQuadruple]().union(*(s.held for s in searches))
        known = known.union(*(search.absences for search in searches))
        return {
            faces: why
            for search in searches
            for faces, why in search.unreached.items()
            if faces not in known
        }

    def _without_room(self) -> int:
        """Number of quadruples with a face that has no room for a contact."""
        roomy = sum(shape is not None for shape in self.shapes[: self.whole])
        shared = sum(
            any(self.shapes[face] is None for face in faces) for faces in self.shared.tolist()
        )
        return math.comb(self.whole, FINGERS) - math.comb(roomy, FINGERS) + shared


def _timed(steps: Iterator[list[Certified]], search: MethodSearch) -> Iterator[list[Certified]]:
    """Yield the same steps, adding their processor time to the search."""
    while True:
        start = time.process_time()
        step = next(steps, None)
        search.seconds += time.process_time() - start
        if step is None:
            return
        yield step
