from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.closure.closure_certificate import ClosureCertificate
from grasp_core.families import free
from grasp_core.families.absence_certificate import Absence, part_at
from grasp_core.families.free import Undecided, close_patch, place_by_forces, place_free
from grasp_core.families.placements import Placement
from grasp_core.objects.booleans import extrusion
from grasp_core.objects.face_pieces import unit_pieces
from scenes.example_objects import example_object
from tests.grasp_core.bodies import from_edges
from tests.grasp_core.regular_solids import TOLERANCE
from tests.judges import least_weight, pyramid_wrenches
from tests.tampering.changes import forged

FRICTIONS = (0.2, 0.3, 0.5, 0.8)
OBJECTS = ("random-8-1", "random-12-3", "random-20-7", "random-30-2")
PER_OBJECT = 8
"""Quadruples of each object at each friction."""
NO_GRASP_BUT_CLOSED_PATCH = ("double-wedge-bar", (0, 6, 1, 7), 0.3)
"""The corners of these faces are in closure, but no four contacts are."""


@cache
def faces_of(name):
    return unit_pieces(example_object(name))


def quadruple(name, indices):
    return [faces_of(name)[index] for index in indices]


def normals_of(pieces):
    return np.array([piece.normal for piece in pieces])


def place(pieces, friction, cells=1, seed=0):
    return place_free(pieces, friction, rng=np.random.default_rng(seed), cells=cells)


@cache
def answers():
    """Pieces, friction and answer of random quadruples of different faces."""
    rng = np.random.default_rng(1)
    cases = []
    for name in OBJECTS:
        for friction in FRICTIONS:
            for _ in range(PER_OBJECT):
                pieces = quadruple(name, rng.choice(len(faces_of(name)), 4, replace=False))
                cases.append((pieces, friction, place(pieces, friction)))
    return cases


def of_kind(kind):
    return [case for case in answers() if isinstance(case[2], kind)]


def corners_in_space(piece):
    return piece.origin + piece.corners @ piece.frame.T


def inset(piece, point):
    """Distance of a point of a face to its nearest edge."""
    corners = corners_in_space(piece)
    assert abs(piece.normal @ (point - corners[0])) < TOLERANCE
    return from_edges(corners, piece.normal, point).min()


def insets(pieces, points):
    return np.array([inset(piece, at) for piece, at in zip(pieces, points, strict=True)])


def wrench(points, forces):
    return np.concatenate([forces.sum(axis=0), np.cross(points, forces).sum(axis=0)])


def split_absence():
    name, indices, friction = NO_GRASP_BUT_CLOSED_PATCH
    return place(quadruple(name, indices), friction, cells=60)


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
        assert gc.classify_lines(found.positions, found.forces) == "regulus", "they all meet"


def test_placements_balance_strictly_inside_their_faces_and_cones():
    """A linear program with pyramids inside the cones accepts them, too."""
    found = of_kind(Placement)
    for number, (pieces, friction, placed) in enumerate(found):
        normals = normals_of(pieces)
        pushes = np.einsum("ki,ki->k", placed.forces, normals)
        slides = np.linalg.norm(placed.forces - pushes[:, None] * normals, axis=1)
        assert np.abs(wrench(placed.positions, placed.forces)).max() < TOLERANCE
        assert pushes.sum() == pytest.approx(1.0, abs=TOLERANCE)
        assert (slides < friction * pushes).all()
        assert insets(pieces, placed.positions).min() > free.FREE_INSET - TOLERANCE
        assert insets(pieces, placed.positions).min() == pytest.approx(placed.merit, abs=TOLERANCE)
        assert gc.classify_lines(placed.positions, placed.forces) == "regulus"
        if number % 8 == 0:
            inner = pyramid_wrenches(placed.positions, normals, friction, 128, outer=False)
            assert least_weight(inner) > 0.0
    assert len(found) >= 75


def test_nearly_every_quadruple_with_a_closed_patch_gets_a_grasp():
    closed = [case for case in answers() if not isinstance(case[2], Absence)]
    found = of_kind(Placement)
    assert len(closed) >= 75
    assert len(found) >= 0.98 * len(closed)


def test_no_contacts_in_closure_are_found_where_absence_is_proved():
    rng = np.random.default_rng(3)
    absent = of_kind(Absence)[::4]
    for pieces, friction, absence in absent:
        assert absence.verify()
        best = climb(rng, pieces, friction, samples=40, steps=20)
        inner = pyramid_wrenches(best, normals_of(pieces), friction, 16, outer=False)
        assert least_weight(inner) <= 0.0
    assert len(absent) >= 6


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
    cases = of_kind(Placement)[::6]
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
    assert len(cases) >= 12


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
    assert spread[1] > free.FREE_INSET


def test_the_parts_reached_by_cutting_cover_the_faces_without_overlap():
    rng = np.random.default_rng(6)
    for name in OBJECTS:
        pieces = quadruple(name, rng.choice(len(faces_of(name)), 4, replace=False))
        paths = [()]
        for _ in range(12):
            path = paths.pop(rng.integers(len(paths)))
            paths += [(*path, 0), (*path, 1)]
        parts = [part_at(pieces, path) for path in paths]
        for _ in range(50):
            points = [rng.dirichlet(np.ones(len(p.corners))) @ p.corners for p in pieces]
            inside = [
                all(holds(corners, at) for corners, at in zip(part, points, strict=True))
                for part in parts
            ]
            assert sum(inside) == 1


def holds(corners, point):
    """Whether a convex counter-clockwise polygon holds a point."""
    edges, arms = np.roll(corners, -1, axis=0) - corners, point - corners
    return bool((edges[:, 0] * arms[:, 1] >= edges[:, 1] * arms[:, 0]).all())


def halves(absence):
    """Return an absence whose first part is proved by its two halves instead of as a whole."""
    leaves = []
    for path in ((0,), (1,)):
        part = part_at(absence.pieces, path)
        leaves.append((path, close_patch(absence.pieces, part, absence.friction)))
    return replace(absence, leaves=tuple(leaves))


def test_leaves_that_do_not_cover_the_faces_prove_nothing():
    one, two = halves(of_kind(Absence)[0][2]).leaves
    absence = of_kind(Absence)[0][2]
    (whole,) = absence.leaves
    false_name = ((2,), two[1])
    for leaves in ((), (one,), (two,), (one, two, whole), (one, whole), (one, two, two),
                   (one, one), (two, two), (two, false_name)):  # fmt: skip
        assert not replace(absence, leaves=leaves).verify()
    many = split_absence()
    for left_out in range(len(many.leaves)):
        kept = many.leaves[:left_out] + many.leaves[left_out + 1 :]
        assert not replace(many, leaves=kept).verify()


def test_a_proof_for_other_pieces_or_more_friction_proves_nothing():
    cases = of_kind(Absence)[:12]
    for pieces, friction, absence in cases:
        swapped = (pieces[1], pieces[0], *pieces[2:])
        shifted = (replace(pieces[0], origin=pieces[0].origin + 1e-6), *pieces[1:])
        turned = (replace(pieces[0], normal=-pieces[0].normal), *pieces[1:])
        grown = (replace(pieces[0], corners=1.1 * pieces[0].corners), *pieces[1:])
        for others in (swapped, shifted, turned, grown):
            assert not replace(absence, pieces=others).verify()
        assert not replace(absence, friction=friction + 1e-9).verify()
        assert replace(absence, friction=0.5 * friction).verify()
    assert len(cases) == 12


def test_a_leaf_with_an_altered_twist_proves_nothing():
    rng = np.random.default_rng(7)
    cases = of_kind(Absence)[:12]
    for _, _, absence in cases:
        ((path, proof),) = absence.leaves
        wrong = [-proof.separating_wrench, np.zeros(6), np.full(6, np.nan), rng.normal(size=6)]
        for twist in wrong:
            altered = forged(proof, separating_wrench=twist)
            assert not forged(absence, leaves=((path, altered),)).verify()
        stronger = ClosureCertificate(
            False, proof.margin, proof.positions, proof.normals, 50.0 + proof.friction, None,
            proof.separating_wrench,
        )  # fmt: skip
        assert not forged(absence, leaves=((path, stronger),)).verify()
        assert not forged(absence, leaves=((path, forged(proof, closed=True)),)).verify()
    assert len(cases) == 12


def test_a_cover_with_a_hole_too_small_for_floating_point_is_refused():
    """All leaves of a comb of depth 60 but the last: their shares add up to one in floats."""
    pieces = [piece for piece in faces_of("octahedron") if piece.normal[2] < 0.0]
    absence = place(pieces, 0.6)
    comb = [(*([0] * depth), 1) for depth in range(60)]
    leaves = tuple((path, close_patch(pieces, part_at(pieces, path), 0.6)) for path in comb)
    last = (*([0] * 59), 0)
    whole = replace(absence, leaves=leaves[:-1] + tuple(
        (path, close_patch(pieces, part_at(pieces, path), 0.6)) for path in (comb[-1], last)
    ))  # fmt: skip
    assert whole.verify()
    assert sum(0.5 ** len(path) for path in comb) == pytest.approx(1.0, abs=1e-16)
    assert not replace(absence, leaves=leaves).verify()


def test_forces_that_balance_nowhere_on_the_faces_get_no_contacts():
    """A couple of forces across a face, while the other two faces push nothing."""
    for pieces, _, _ in answers()[::16]:
        across = pieces[0].frame[:, 0]
        far = replace(pieces[0], origin=pieces[0].origin + 5.0 * pieces[0].frame[:, 1])
        couple = np.array([across, -across, 0.0 * across, 0.0 * across])
        assert place_by_forces([far, *pieces[1:]], couple) is None
