"""Contacts placed for many attempts at once beside those placed one by one."""

from types import SimpleNamespace

import numpy as np
import pytest

from grasp_core.families import placing
from grasp_core.families.discs_kernel import optimum
from grasp_core.families.placements import LEAST_RADIUS, LEFT, NONE, PLACED, Placement
from grasp_core.families.placing import CONSTRUCTIONS, MIXED, ManyPlacements, regions_of
from grasp_core.objects.face_pieces import face_shapes
from grasp_core.planning.planned_cones import LEAST_SPAN_ANGLE, PlannedCones
from grasp_core.planning.quadruples import all_blocks
from grasp_core.values import ForceCone, four
from scenes.example_objects import example_object
from tests.grasp_core.curved import curved_body

SAME = 1e-9
"""Ten times less than what a program's answer may be off; optima are unique."""
OBJECTS = ("random-12-1", "random-14-3", "dodecahedron", "wedge")
EACH = 40
CASES = {
    "concurrent": CONSTRUCTIONS["concurrent"], "pencil": CONSTRUCTIONS["pencil"], "mixed": MIXED,
}  # fmt: skip


def attempts(body, theta, orders, count=EACH):
    """Faces in finger order with force cones that positively span, around normals and tilted."""
    shapes = face_shapes(body)
    cones = PlannedCones(body, shapes, theta, tilted=True)
    _, make = all_blocks(cones, len(body.faces), np.empty((0, 4), dtype=np.int64))
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


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("friction", [0.18, 0.5, 0.9])
def test_many_placements_are_those_placed_one_by_one(case, friction):
    construction, ends = CASES[case], {True: 0, False: 0}
    for name in OBJECTS:
        pieces, listed = attempts(
            example_object(name), float(np.arctan(friction)), construction.orders
        )
        asked = [(faces, cones, LEAST_RADIUS) for faces, cones in listed]
        for (faces, cones, least), known in zip(
            asked, ManyPlacements(pieces).of(construction, asked), strict=True
        ):
            on = [pieces[face] for face in faces]
            alone = construction.place(on, cones, least)
            assert known is not None
            assert isinstance(alone, Placement) is (known.placement is not None)
            ends[known.placement is not None] += 1
            if known.placement is not None:
                agrees(known.placement, alone)
                regions = regions_of(construction.region, on, cones, alone)
                for one, other in zip(known.regions, regions, strict=True):
                    assert one.kind == other.kind
                    assert not one.polygon.flags.writeable
                    np.testing.assert_allclose(one.polygon, other.polygon, rtol=0.0, atol=SAME)
                    assert one.inscribed_radius == pytest.approx(other.inscribed_radius, abs=SAME)
    assert sum(ends.values()) == EACH * len(OBJECTS)
    assert ends[True] >= (0 if case == "mixed" else 100)
    assert ends[False] >= (10 if case == "mixed" else 0)


def agrees(one, other):
    for name in ("positions", "forces", "foci", "radii"):
        np.testing.assert_allclose(getattr(one, name), getattr(other, name), rtol=0.0, atol=SAME)
    assert one.merit == pytest.approx(other.merit, abs=SAME)


def test_curved_patches_are_allowed_for():
    """Patches have depths, which the rows of the programs lose."""
    body = curved_body()
    construction, placed = CONSTRUCTIONS["concurrent"], 0
    pieces, listed = attempts(body, 0.6, construction.orders)
    assert max(piece.depth for piece in pieces if piece) > 0.0
    asked = [(faces, cones, LEAST_RADIUS) for faces, cones in listed]
    for ask, known in zip(asked, ManyPlacements(pieces).of(construction, asked), strict=True):
        alone = construction.place([pieces[face] for face in ask[0]], *ask[1:])
        assert isinstance(alone, Placement) is (known.placement is not None)
        if known.placement is not None:
            agrees(known.placement, alone)
            placed += 1
    assert placed >= 10


def test_discs_that_are_too_small_are_proved_to_be_none():
    construction = CONSTRUCTIONS["pencil"]
    pieces, listed = attempts(example_object("random-12-1"), 0.4, construction.orders)
    known = ManyPlacements(pieces).of(construction, [(*each, 10.0) for each in listed])
    assert len(known) == EACH
    assert all(each is not None and each.placement is None for each in known)


def test_reguli_and_cones_of_different_widths_are_left():
    pieces, listed = attempts(example_object("random-12-1"), 0.4, ((0, 1, 2, 3),))
    faces, cones = listed[0]
    wider = ForceCone(cones[3].axis, 0.5 * cones[3].half_angle)
    many = ManyPlacements(pieces)
    assert many.of(CONSTRUCTIONS["regulus"], [(faces, cones, -np.inf)]) == [None]
    assert many.of(CONSTRUCTIONS["pencil"], [(faces, (*cones[:3], wider), 1e-3)]) == [None]
    assert many.of(CONSTRUCTIONS["pencil"], []) == []


def test_what_compiled_code_leaves_is_left(monkeypatch):
    construction = CONSTRUCTIONS["concurrent"]
    pieces, listed = attempts(example_object("random-12-1"), 0.4, construction.orders)
    kernels = placing.compiled

    def leaving(name):
        kernel = kernels(name)

        def place(*given):
            kernel.place(*given)
            given[-1].ends[::2] = LEFT

        return SimpleNamespace(place=place, footprints=kernel.footprints)

    monkeypatch.setattr(placing, "compiled", leaving)
    asked = [(*each, LEAST_RADIUS) for each in listed]
    known = ManyPlacements(pieces).of(construction, asked)
    assert [each is None for each in known] == [i % 2 == 0 for i in range(EACH)]


def test_programs_in_compiled_code_end_as_they_should():
    """A square: its corner, a bound below the cutoff, no bound at all, nothing feasible, NaN."""
    A = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
    b, c, x = np.array([1.0, 2.0, 0.0, 0.0]), np.array([1.0, 1.0]), np.zeros(2)
    assert optimum(c, A, b, -np.inf, x) == (PLACED, pytest.approx(3.0, abs=1e-12))
    np.testing.assert_allclose(x, [1.0, 2.0], rtol=0.0, atol=1e-12)
    end, bound = optimum(c, A, b, 5.0, x)
    assert end == NONE
    assert 3.0 - 1e-9 <= bound <= 5.0
    assert optimum(c, A[2:].copy(), b[2:].copy(), -np.inf, x)[0] == LEFT
    assert optimum(c, A, np.array([1.0, 2.0, -3.0, 0.0]), -np.inf, x)[0] == LEFT
    assert optimum(c, A, np.array([1.0, np.nan, 0.0, 0.0]), -np.inf, x)[0] == LEFT
    assert optimum(np.array([1.0, np.nan]), A, b, -np.inf, x)[0] == LEFT
