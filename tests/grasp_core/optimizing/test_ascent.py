import numpy as np
import pytest

import grasp_core as gc
from grasp_core.objects.face_pieces import inset_piece
from grasp_core.optimizing.ascent import ContactFaces
from grasp_core.optimizing.better_contacts import pieces_under
from scenes.example_objects import example_object


def contacts_of(body, grasp, inset=0.05):
    """The faces of a grasp with room to move, and its contacts in their planes."""
    pieces = pieces_under(body, grasp)
    rooms = [inset_piece(piece, inset) for piece in pieces]
    points = (grasp.positions - body.center_of_mass) / body.radius
    y = np.array([p.frame.T @ (at - p.origin) for p, at in zip(pieces, points, strict=True)])
    limits = [np.maximum(room.b, room.E @ at) for room, at in zip(rooms, y, strict=True)]
    return ContactFaces(pieces, tuple(limits), 0.5), y


@pytest.fixture(scope="module")
def wedge():
    body = example_object("wedge")
    return body, gc.plan(body, 0.5, limit=12, cones="normal").grasps


def test_slopes_of_the_nearest_planes_predict_small_moves(wedge):
    """The lowest of the linearised distances against the quality itself, 1e-4 away.

    Both bounds are good to 1e-7 of the quality; curvature adds about the move's square.
    """
    body, grasps = wedge
    rng, tested = np.random.default_rng(1), 0
    for grasp in grasps:
        faces, y = contacts_of(body, grasp)
        here = faces.quality(y, gap=1e-7)
        distances, slopes = faces.nearest_planes(here, here.polytope)
        for _ in range(3):
            move = 1e-4 * rng.normal(size=y.size)
            predicted = (distances + slopes @ move).min() - distances.min()
            there = faces.quality(y + move.reshape(y.shape), gap=1e-7)
            steepest = np.abs(slopes).max() * np.abs(move).sum()
            assert there.lower - here.lower == pytest.approx(predicted, abs=0.02 * steepest)
            tested += 1
    assert tested >= 30


def test_a_climb_stays_within_the_limits_and_never_goes_down(wedge):
    body, grasps = wedge
    raised = 0
    for grasp in grasps:
        faces, y = contacts_of(body, grasp)
        end, found = faces.climbed(y)
        assert found.lower >= faces.quality(y).lower
        for piece, limit, at in zip(faces.pieces, faces.limits, end, strict=True):
            assert (piece.E @ at <= limit + 1e-9).all()
        raised += found.lower > 1.01 * faces.quality(y).lower
    assert raised >= 0.8 * len(grasps)


def test_contacts_out_of_closure_stay_where_they_are(wedge):
    body, grasps = wedge
    faces, y = contacts_of(body, grasps[0])
    weak = ContactFaces(faces.pieces, faces.limits, 1e-4)
    end, found = weak.climbed(y)
    np.testing.assert_array_equal(end, y)
    assert found.lower <= 0.0


def test_no_small_move_from_the_end_of_a_climb_is_much_better(wedge):
    """Random feasible moves of up to a hundredth: none gains a hundredth."""
    body, grasps = wedge
    rng, tested = np.random.default_rng(2), 0
    for grasp in grasps[:6]:
        faces, y = contacts_of(body, grasp)
        end, found = faces.climbed(y)
        for _ in range(60):
            moved = end + rng.uniform(-0.01, 0.01, size=end.shape)
            room = zip(faces.pieces, faces.limits, moved, strict=True)
            if all((piece.E @ at <= limit).all() for piece, limit, at in room):
                assert faces.quality(moved).lower <= 1.01 * found.lower
                tested += 1
    assert tested >= 20
