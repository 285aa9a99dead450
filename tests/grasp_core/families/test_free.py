import numpy as np
import pytest

import grasp_core as gc
from grasp_core.families import free
from grasp_core.families.free import Absence, Undecided, close_patch
from grasp_core.families.placements import Placement
from grasp_core.objects.booleans import extrusion
from grasp_core.objects.face_pieces import unit_pieces
from tests.grasp_core.families.free_cases import (
    FRICTIONS,
    NO_GRASP_BUT_CLOSED_PATCH,
    OBJECTS,
    TOLERANCE,
    answers,
    corners_in_space,
    faces_of,
    insets,
    normals_of,
    of_kind,
    place,
    quadruple,
    split_absence,
    wrench,
)
from tests.judges import pyramid_margin
from tests.marks import more

NEEDS_A_SPLIT = ("cross", (29, 14, 25, 21), 0.8)
"""A grasp that neither the forces of the patch nor those of shrunk patches lead to."""


def random_contacts(rng, pieces):
    """A point of each face: anywhere, on an edge, or a corner."""
    points = []
    for piece in pieces:
        corners = corners_in_space(piece)
        start = rng.integers(len(corners))
        edge = corners[[start, (start + 1) % len(corners)]]
        share = rng.uniform()
        points.append(
            [
                rng.dirichlet(np.ones(len(corners))) @ corners,
                share * edge[0] + (1.0 - share) * edge[1],
                edge[0],
            ][rng.choice(3, p=[0.4, 0.3, 0.3])]
        )
    return np.array(points)


def margin_at(points, pieces, friction):
    """The exact margin, checked to be no closure; on the boundary itself nothing is claimed."""
    try:
        verdict = gc.force_closure(points, normals_of(pieces), friction)
    except gc.UndecidedError:
        return 0.0
    assert not verdict.closed
    return verdict.margin


def climb(rng, pieces, friction, samples, steps):
    """The contacts of largest margin that sampling and then small moves find."""
    drawn = [random_contacts(rng, pieces) for _ in range(samples)]
    best = max(drawn, key=lambda points: margin_at(points, pieces, friction))
    margin = margin_at(best, pieces, friction)
    for step in range(steps):
        reach = 0.5 ** (1 + 6 * step / steps)
        tried = best + reach * (random_contacts(rng, pieces) - best)
        if (found := margin_at(tried, pieces, friction)) > margin:
            best, margin = tried, found
    return best


def test_the_upper_faces_of_the_octahedron_need_a_friction_of_one_over_root_two():
    pieces = [piece for piece in faces_of("octahedron") if piece.normal[2] < 0.0]
    assert len(pieces) == 4
    for friction in (0.2, 0.70, 0.7071):
        absent = place(pieces, friction)
        assert isinstance(absent, Absence)
        assert absent.verify()
    for friction in (0.7072, 0.72, 1.0):
        found = place(pieces, friction)
        assert isinstance(found, Placement)
        assert gc.force_closure(found.positions, normals_of(pieces), friction).closed


def test_the_sides_of_a_box_are_grasped_where_no_directions_positively_span():
    pieces = [piece for piece in faces_of("box") if abs(piece.normal[2]) < 0.5]
    assert gc.span_angle(normals_of(pieces)) == 0.0
    found = place(pieces, 0.5)
    assert isinstance(found, Placement)
    assert gc.force_closure(found.positions, normals_of(pieces), 0.5).closed
    assert gc.classify_lines(found.positions, found.forces) == "regulus"


def test_placements_balance_strictly_inside_their_faces_and_cones():
    found = of_kind(Placement)
    for pieces, friction, placed in found:
        normals = normals_of(pieces)
        pushes = np.einsum("ki,ki->k", placed.forces, normals)
        slides = np.linalg.norm(placed.forces - pushes[:, None] * normals, axis=1)
        assert np.abs(wrench(placed.positions, placed.forces)).max() < TOLERANCE
        assert pushes.sum() == pytest.approx(1.0, abs=TOLERANCE)
        assert (slides < friction * pushes).all()
        assert insets(pieces, placed.positions).min() > free.LEAST_INSET - TOLERANCE
        assert insets(pieces, placed.positions).min() == pytest.approx(placed.merit, abs=TOLERANCE)
        assert gc.classify_lines(placed.positions, placed.forces) == "regulus"
    assert len(found) >= 250


@pytest.mark.parametrize("every", [5, *more(1)])
def test_a_linear_program_with_inner_pyramids_accepts_the_placements(every):
    found = of_kind(Placement)[::every]
    for pieces, friction, placed in found:
        normals = normals_of(pieces)
        assert pyramid_margin(placed.positions, normals, friction, 128, outer=False) > 0.0
        spread = np.linalg.svd(placed.positions - placed.positions.mean(axis=0), compute_uv=False)
        assert spread[1] > free.LEAST_INSET
    assert len(found) >= 250 // every


def test_symmetric_faces_too_are_held_by_a_regulus():
    """The forces of their patches all meet, before internal forces are added."""
    tested = 0
    for name in ("tetrahedron", "octahedron", "dodecahedron", "icosahedron", "box", "prism"):
        rng = np.random.default_rng(2)
        for friction in FRICTIONS:
            for _ in range(8):
                pieces = quadruple(name, rng.choice(len(faces_of(name)), 4, replace=False))
                placed = place(pieces, friction)
                if not isinstance(placed, Placement):
                    continue
                assert gc.classify_lines(placed.positions, placed.forces) == "regulus"
                assert gc.force_closure(placed.positions, normals_of(pieces), friction).closed
                tested += 1
    assert tested >= 100


def test_nearly_every_quadruple_with_a_closed_patch_gets_a_grasp():
    closed = [case for case in answers() if not isinstance(case[2], Absence)]
    found = of_kind(Placement)
    assert len(closed) >= 250
    assert len(found) >= 0.98 * len(closed)


@pytest.mark.parametrize("every", [4, *more(1)])
def test_no_contacts_in_closure_are_found_where_absence_is_proved(every):
    rng = np.random.default_rng(3)
    absent = of_kind(Absence)[::every]
    for pieces, friction, absence in absent:
        assert absence.verify()
        best = climb(rng, pieces, friction, samples=40, steps=20)
        assert pyramid_margin(best, normals_of(pieces), friction, 16, outer=False) <= 0.0
    assert len(absent) >= 60 // every


@pytest.mark.parametrize("each", [1, *more(6)])
def test_absence_holds_up_to_the_friction_at_which_the_patch_closes(each):
    """Just above it a grasp is found at once, or nearly always."""
    rng = np.random.default_rng(4)
    tested = found = 0
    for name in OBJECTS:
        for _ in range(each):
            pieces = quadruple(name, rng.choice(len(faces_of(name)), 4, replace=False))
            lower, upper = 0.0, 4.0
            for _ in range(16):
                middle = 0.5 * (lower + upper)
                held = isinstance(place(pieces, middle), Absence)
                lower, upper = (middle, upper) if held else (lower, middle)
            if lower == 0.0 or upper == 4.0:
                continue
            absence = place(pieces, lower)
            assert isinstance(absence, Absence)
            assert absence.verify()
            climb(rng, pieces, lower, samples=40, steps=40)
            above = place(pieces, 1.02 * upper + 1e-3)
            assert not isinstance(above, Absence)
            found += isinstance(above, Placement)
            tested += 1
    assert tested >= 2.5 * each
    assert found >= 0.9 * tested


def test_splitting_proves_absence_where_the_patch_of_the_whole_faces_is_closed():
    name, indices, friction = NO_GRASP_BUT_CLOSED_PATCH
    pieces = quadruple(name, indices)
    whole = close_patch(pieces, tuple(piece.corners for piece in pieces), friction)
    assert whole.closed
    assert place(pieces, friction) == Undecided(1.0)
    absence = split_absence()
    assert isinstance(absence, Absence)
    assert len(absence.leaves) > 1
    assert absence.verify()
    climb(np.random.default_rng(5), pieces, friction, samples=400, steps=200)


def test_restarts_and_splits_stand_in_for_the_first_try(monkeypatch):
    """With the forces of the whole patch unused, half of the ways still lead to a grasp."""
    tried = free.grasp_from_patch

    def only_smaller(pieces, part, certificate, friction):
        whole = all(one is piece.corners for one, piece in zip(part, pieces, strict=True))
        return None if whole else tried(pieces, part, certificate, friction)

    monkeypatch.setattr(free, "grasp_from_patch", only_smaller)
    cases = of_kind(Placement)[::5]
    restarted = [place(pieces, friction) for pieces, friction, _ in cases]
    monkeypatch.setattr(free, "RESTARTS", 0)
    split = [place(pieces, friction, cells=20) for pieces, friction, _ in cases]
    for found in (restarted, split):
        held = 0
        for (pieces, friction, _), placed in zip(cases, found, strict=True):
            assert not isinstance(placed, Absence)
            if isinstance(placed, Placement):
                assert gc.force_closure(placed.positions, normals_of(pieces), friction).closed
                held += 1
        assert held >= 0.9 * len(cases)
    assert len(cases) >= 50


def test_a_grasp_of_two_parallel_slabs_is_not_along_one_line():
    """Forces across two slabs on a base balance at contacts in a row through their middles,
    which resist no turning about it: contacts on a line are never in force closure, and within
    rounding of a line they are of no use though their wrenches may have full rank.
    """
    square = 0.03 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    slab = extrusion(square * [0.2, 1.0], 0.06)
    body = (
        extrusion(2.0 * square, 0.02).moved((0.0, 0.0, -0.02))
        + slab.moved((-0.03, 0.0, 0.0))
        + slab.moved((0.03, 0.0, 0.0))
    )
    pieces = unit_pieces(gc.Polyhedron.from_mesh(body.vertices, body.triangles, name="slabs"))
    center = np.mean([piece.origin for piece in pieces], axis=0)
    walls = [p for p in pieces if abs(p.normal[0]) > 0.5 and p.origin[2] > center[2]]
    assert len(walls) == 4
    placed = place(walls, 0.5)
    assert isinstance(placed, Placement)
    spread = np.linalg.svd(placed.positions - placed.positions.mean(axis=0), compute_uv=False)
    assert spread[1] > free.LEAST_INSET
