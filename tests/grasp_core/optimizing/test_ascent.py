from dataclasses import replace

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.objects.face_pieces import inset_piece
from grasp_core.optimizing.ascent import ContactFaces
from grasp_core.optimizing.better_contacts import pieces_under
from grasp_core.quality.ferrari_canny import wrench_set_quality
from grasp_core.quality.measures import SMALL_LENGTH, thin
from scenes.example_objects import example_object


def contacts_of(body, grasp, inset=0.05):
    """The faces of a grasp with room to move, and its contacts in their planes."""
    rooms = [inset_piece(piece, inset) for piece in pieces_under(body, grasp)]
    points = (grasp.positions - body.center_of_mass) / body.radius
    y = np.array([p.frame.T @ (at - p.origin) for p, at in zip(rooms, points, strict=True)])
    given = zip(rooms, y, strict=True)
    pieces = tuple(replace(room, b=np.maximum(room.b, room.E @ at)) for room, at in given)
    return ContactFaces(pieces, 0.5), y


@pytest.fixture(scope="module")
def wedge():
    body = example_object("wedge")
    return body, gc.plan(body, 0.5, limit=12, settings=gc.PlanSettings(cones="normal")).grasps


def ball(faces, y, length):
    """The quality of contacts, or the ball that bounds the weight that they hold."""
    wrenches = faces.wrenches(y)
    return wrench_set_quality(wrenches if length == 1.0 else thin(wrenches), 1e-7)


@pytest.mark.parametrize("length", [1.0, SMALL_LENGTH])
def test_slopes_of_the_nearest_planes_predict_small_moves(wedge, length):
    """The lowest of the linearised distances against the quality itself, 1e-4 away.

    Both bounds are good to 1e-7 of the quality; curvature adds about the move's square.
    """
    body, grasps = wedge
    rng, tested = np.random.default_rng(1), 0
    for grasp in grasps:
        faces, y = contacts_of(body, grasp)
        here = ball(faces, y, length)
        distances, slopes = faces.nearest_planes(here, length)
        for _ in range(3):
            move = 1e-4 * rng.normal(size=y.size)
            predicted = (distances + slopes @ move).min() - distances.min()
            there = ball(faces, y + move.reshape(y.shape), length)
            steepest = np.abs(slopes).max() * np.abs(move).sum()
            assert there.lower - here.lower == pytest.approx(predicted, abs=0.02 * steepest)
            tested += 1
    assert tested >= 30


def test_a_climb_stays_within_the_limits_and_ends_where_no_small_move_is_much_better(wedge):
    """It never goes down. Random feasible moves of up to a hundredth gain no hundredth."""
    body, grasps = wedge
    rng, raised, tested = np.random.default_rng(2), 0, 0
    for grasp in grasps[:4]:
        faces, y = contacts_of(body, grasp)
        end, found = faces.climb(y)
        assert found.lower >= faces.quality(y).lower
        for piece, at in zip(faces.pieces, end, strict=True):
            assert (piece.E @ at <= piece.b + 1e-9).all()
        raised += found.lower > 1.01 * faces.quality(y).lower
        for _ in range(40):
            moved = end + rng.uniform(-0.01, 0.01, size=end.shape)
            room = zip(faces.pieces, moved, strict=True)
            if all((piece.E @ at <= piece.b).all() for piece, at in room):
                assert faces.quality(moved).lower <= 1.01 * found.lower
                tested += 1
    assert raised >= 3
    assert tested >= 10


def test_contacts_out_of_closure_stay_where_they_are(wedge):
    body, grasps = wedge
    faces, y = contacts_of(body, grasps[0])
    weak = ContactFaces(faces.pieces, 1e-4)
    end, found = weak.climb(y)
    np.testing.assert_array_equal(end, y)
    assert found.lower <= 0.0
