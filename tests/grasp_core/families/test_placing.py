"""Contacts placed for many attempts at once."""

from functools import partial

import numpy as np
import pytest

from grasp_core.errors import SolverError
from grasp_core.families.placements import LEAST_RADIUS, face_table
from grasp_core.families.placing import CONSTRUCTIONS, MIXED, attempts_of, regions_of
from grasp_core.objects.face_pieces import edge_rows, face_shapes, inscribed_radius
from grasp_core.planning.quadruples import LEAST_SPAN_ANGLE, PlannedCones, all_blocks
from grasp_core.solvers.lp import LP_RESIDUAL
from grasp_core.values import ForceCone, four
from scenes.example_objects import example_object
from tests.grasp_core.curved import curved_body
from tests.grasp_core.families import reference_programs as programs
from tests.grasp_core.quadruples import leave_all

SAME = 1e-9
"""Ten times less than what a program's answer may be off; optima are unique."""
BODIES = {
    name: partial(example_object, name)
    for name in ("random-12-1", "random-14-3", "dodecahedron", "wedge", "l-bracket")
} | {"curved": curved_body}  # fmt: skip
EACH = 12
CASES = {
    "concurrent": CONSTRUCTIONS["concurrent"], "pencil": CONSTRUCTIONS["pencil"], "mixed": MIXED,
}  # fmt: skip


def attempts(body, theta, orders, count=EACH):
    """Faces in finger order with force cones that positively span, around normals and tilted."""
    shapes = face_shapes(body)
    cones = PlannedCones(body, shapes, theta, tilted=True)
    make = all_blocks(cones, len(body.faces), np.empty((0, 4), dtype=np.int64)).make
    table = make(0).coned(slice(None))
    found = []
    for row, kind in zip(*np.nonzero(table.half_angles > LEAST_SPAN_ANGLE), strict=True):
        order = orders[len(found) % len(orders)]
        angle = float(table.half_angles[row, kind])
        found.append(
            (
                four(int(table.faces[row, finger]) for finger in order),
                four(ForceCone(table.axes[row, kind, finger], angle) for finger in order),
            )
        )
    picks = np.random.default_rng(0).permutation(len(found))[:count]
    return [shape.hull if shape else None for shape in shapes], [found[i] for i in picks]


def placed(construction, pieces, listed, least=LEAST_RADIUS):
    """What a construction places for each attempt, all of them asked for at once."""
    many = construction.placed(face_table(pieces), attempts_of(listed), np.full(len(listed), least))
    return [construction.one_of(many, a) for a in range(len(listed))]


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("friction", [0.18, 0.5])
def test_discs_are_the_largest_that_plain_rows_allow_and_so_are_their_bounds(case, friction):
    """The rows of curved surfaces lose the depths of patches."""
    construction, ends, deepest = CASES[case], {True: 0, False: 0}, 0.0
    plain = programs.pencil if case == "pencil" else programs.concurrent
    for make in BODIES.values():
        pieces, listed = attempts(make(), float(np.arctan(friction)), construction.orders)
        deepest = max(deepest, *(piece.depth for piece in pieces if piece))
        found = placed(construction, pieces, listed)
        bounds = construction.bounds(face_table(pieces), attempts_of(listed), LEAST_RADIUS)
        for (faces, cones), at, bound in zip(listed, found, bounds, strict=True):
            on = [pieces[face] for face in faces]
            best = max(plain(on, cones, signs) for signs in construction.patterns)
            assert (at is not None) is (best >= LEAST_RADIUS)
            ends[at is not None] += 1
            if at is not None:
                assert at.merit == pytest.approx(
                    best - LP_RESIDUAL, abs=1e-6 * best
                )  # of equal ones
                assert bound == pytest.approx(best + LP_RESIDUAL, abs=2e-8)
            else:
                assert bound <= LEAST_RADIUS + 2e-8
    assert deepest > 0.0
    assert sum(ends.values()) >= EACH * (len(BODIES) - 1)
    assert ends[True] >= (0 if case == "mixed" else 30)
    assert ends[False] >= (3 if case == "mixed" else 0)


def agrees(one, other):
    for name in ("positions", "forces", "foci", "radii"):
        np.testing.assert_allclose(getattr(one, name), getattr(other, name), rtol=0.0, atol=SAME)
    assert one.merit == pytest.approx(other.merit, abs=SAME)


@pytest.mark.parametrize("case", ["concurrent", "mixed"])
def test_regions_are_the_faces_cut_to_the_inverted_cones(case):
    construction, planned = CASES[case], []
    for make in BODIES.values():
        pieces, listed = attempts(make(), 0.4, construction.orders)
        for (faces, cones), at in zip(listed, placed(construction, pieces, listed), strict=True):
            if at is not None:
                planned.append(([pieces[face] for face in faces], cones, at))
    for (pieces, cones, at), regions in zip(planned, regions_of("cone", planned), strict=True):
        for piece, cone, contact, region in zip(pieces, cones, at.positions, regions, strict=True):
            polygon = programs.footprint(piece, cone, at.foci[0], contact)
            rows = edge_rows((polygon - piece.origin) @ piece.frame)
            assert not region.polygon.flags.writeable
            np.testing.assert_allclose(region.polygon, polygon, rtol=0.0, atol=SAME)
            assert region.inscribed_radius == pytest.approx(inscribed_radius(*rows), abs=SAME)
    assert len(planned) >= (6 if case == "mixed" else 30)


def test_discs_that_are_too_small_are_proved_to_be_none():
    construction = CONSTRUCTIONS["pencil"]
    pieces, listed = attempts(example_object("random-12-1"), 0.4, construction.orders)
    assert placed(construction, pieces, listed, 10.0) == [None] * EACH


def test_of_cones_with_different_widths_the_narrowest_counts():
    pieces, listed = attempts(example_object("random-12-1"), 0.4, ((0, 1, 2, 3),))
    faces, cones = listed[0]
    narrow = four(ForceCone(cone.axis, 0.5 * cone.half_angle) for cone in cones)
    mixed = (*cones[:3], narrow[3])
    one, other = placed(CONSTRUCTIONS["pencil"], pieces, [(faces, narrow), (faces, mixed)])
    agrees(one, other)


def test_a_program_that_is_not_solved_is_said_to_fail(monkeypatch):
    pieces, listed = attempts(example_object("random-12-1"), 0.4, ((0, 1, 2, 3),))
    leave_all(monkeypatch)
    with pytest.raises(SolverError, match="neither solved nor proved"):
        placed(CONSTRUCTIONS["concurrent"], pieces, listed[:1])
