"""Splits the face quadruples that no construction holds into batches for the free method."""

from collections.abc import Iterable, Iterator, Sequence
from collections.abc import Set as AbstractSet
from itertools import combinations, islice

from grasp_core.families.placing import chosen_shapes
from grasp_core.objects.standard_order import Standard
from grasp_core.planning.certify import Certified
from grasp_core.planning.family_search import MethodSearch
from grasp_core.planning.free_search import found_on
from grasp_core.planning.request import PlanRequest
from grasp_core.values import FINGERS, FaceQuadruple, four

BATCH, LIMITED_BATCH = 1024, 64
"""Number of face quadruples that are decided together, and with a limit on the grasps."""


def search_free(
    on: Standard, request: PlanRequest, search: MethodSearch, held: AbstractSet[FaceQuadruple]
) -> Iterator[list[Certified]]:
    """Go through the quadruples that no family holds, until the limit is reached."""
    for batch in batches(on, LIMITED_BATCH):
        if search.full:
            return
        to_try = without_grasp(on, batch, held)
        found = found_on(on, to_try, request, search.gathered)
        yield from kept_on(batch, to_try, ([each] if each else [] for each in found), search)


def kept_on(
    batch: Sequence[FaceQuadruple],
    tried: Sequence[FaceQuadruple],
    found: Iterable[list[Certified]],
    search: MethodSearch,
) -> Iterator[list[Certified]]:
    """Keep the grasps found on a batch; yield those of each quadruple, tried or not."""
    these, grasps = set(tried), iter(found)
    for faces in batch:
        yield search.keep_each(next(grasps)) if faces in these else []
    next(grasps, None)  # runs the search to its end, where its counts are complete


def batches(on: Standard, size: int) -> Iterator[Sequence[FaceQuadruple]]:
    """Yield all quadruples of faces in batches; the ones with two halves of a face come last."""
    quadruples = _every_quadruple(on)
    while batch := list(islice(quadruples, size)):
        yield batch


def without_grasp(
    on: Standard, batch: Sequence[FaceQuadruple], held: AbstractSet[FaceQuadruple]
) -> tuple[FaceQuadruple, ...]:
    """Select the quadruples on which no grasp was found and whose faces have room for contacts."""
    return tuple(
        faces
        for faces in batch
        if faces not in held and len(chosen_shapes(on.shapes, faces)) == FINGERS
    )


def _every_quadruple(on: Standard) -> Iterator[FaceQuadruple]:
    """Yield all quadruples of faces, in the order of `batches`."""
    yield from combinations(range(len(on.faces)), FINGERS)
    for faces in on.shared.tolist():
        yield four(faces)
