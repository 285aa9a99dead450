"""What proves that four faces have no grasp, and what does not."""

from dataclasses import replace

import numpy as np
import pytest

from grasp_core.closure.force_closure import ClosureCertificate
from grasp_core.families.free import Absence, close_patch, part_at
from tests.grasp_core.families.free_cases import (
    OBJECTS,
    faces_of,
    of_kind,
    place,
    quadruple,
    split_absence,
)


def test_the_parts_reached_by_cutting_cover_the_faces_without_overlap():
    rng = np.random.default_rng(6)
    tested = 0
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
            tested += 1
    assert tested == 200


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


@pytest.mark.slow
def test_halves_prove_what_the_whole_proves():
    absent = of_kind(Absence)[:40]
    assert len(absent) >= 10
    assert all(halves(absence).verify() for _, _, absence in absent)
    assert len(absent) == 40


def test_leaves_that_do_not_cover_the_faces_prove_nothing():
    one, two = halves(of_kind(Absence)[0][2]).leaves
    absence = of_kind(Absence)[0][2]
    (whole,) = absence.leaves
    for leaves in ((), (one,), (two,), (one, two, whole), (one, whole), (one, two, two)):
        assert not replace(absence, leaves=leaves).verify()
    many = split_absence()
    for left_out in range(len(many.leaves)):
        kept = many.leaves[:left_out] + many.leaves[left_out + 1 :]
        assert not replace(many, leaves=kept).verify()


def test_a_half_proved_twice_does_not_prove_the_other_half():
    absence = of_kind(Absence)[0][2]
    one, two = halves(absence).leaves
    assert not replace(absence, leaves=(one, one)).verify()
    assert not replace(absence, leaves=(two, two)).verify()


def test_a_half_under_another_name_does_not_prove_the_other_half():
    """Only 0 and 1 name halves."""
    absence = of_kind(Absence)[0][2]
    _, (path, proof) = halves(absence).leaves
    assert path == (1,)
    assert not replace(absence, leaves=(((1,), proof), ((2,), proof))).verify()


def test_a_proof_for_other_pieces_or_more_friction_proves_nothing():
    cases = of_kind(Absence)[:40]
    for pieces, friction, absence in cases:
        swapped = (pieces[1], pieces[0], *pieces[2:])
        shifted = (replace(pieces[0], origin=pieces[0].origin + 1e-6), *pieces[1:])
        turned = (replace(pieces[0], normal=-pieces[0].normal), *pieces[1:])
        grown = (replace(pieces[0], corners=1.1 * pieces[0].corners), *pieces[1:])
        for others in (swapped, shifted, turned, grown):
            assert not replace(absence, pieces=others).verify()
        assert not replace(absence, friction=friction + 1e-9).verify()
        assert replace(absence, friction=0.5 * friction).verify()
    assert len(cases) == 40


def test_a_leaf_with_an_altered_twist_proves_nothing():
    rng = np.random.default_rng(7)
    cases = of_kind(Absence)[:40]
    for _, _, absence in cases:
        ((path, proof),) = absence.leaves
        wrong = [-proof.separating_wrench, np.zeros(6), np.full(6, np.nan), rng.normal(size=6)]
        for twist in wrong:
            altered = replace(proof, separating_wrench=twist)
            assert not replace(absence, leaves=((path, altered),)).verify()
        stronger = ClosureCertificate(
            False, proof.margin, proof.positions, proof.normals, 50.0 + proof.friction, None,
            proof.separating_wrench,
        )  # fmt: skip
        assert not replace(absence, leaves=((path, stronger),)).verify()
        assert not replace(absence, leaves=((path, replace(proof, closed=True)),)).verify()
    assert len(cases) == 40


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
