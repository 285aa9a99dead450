"""Figures of grasps are what the analysis says of their contacts, and forged ones are named."""

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.closure.contacts import stacked
from grasp_core.hands.hand_arrays import places
from grasp_core.objects.on_faces import nearest_on_triangles
from sim_validate.datasets.verify import verify
from tests.sim_validate.datasets.configs import BODIES, rows_of
from tests.sim_validate.datasets.forging import forged


@pytest.fixture(scope="module")
def grasps(learned):
    return rows_of(learned, "grasps")


def contacts_of(row):
    return [
        gc.Contact(point, normal)
        for point, normal in zip(row["contact_points_m"], row["contact_normals"], strict=True)
        if point[0] is not None
    ]


def test_closure_figures_are_those_of_the_contacts(grasps):
    rows = [row for row in grasps if row["contacts"] == 4]
    assert len({row["kind"] for row in rows}) >= 6
    for row in rows:
        body, contacts = BODIES[row["object_id"]], contacts_of(row)
        about = {"center": body.center_of_mass, "torque_scale": body.radius}
        assert row["smallest_singular_value"] == gc.smallest_singular_value(contacts, **about)
        assert row["span_angle_rad"] == gc.span_angle(stacked(contacts)[1])


def test_witness_forces_balance_within_the_cones(grasps):
    """Forces whose normal parts sum to one leave less than the certificates' tolerance."""
    rows = [row for row in grasps if row["witness_forces_n"] is not None]
    assert {row["force_closed"] for row in rows} == {True}
    for row in rows:
        forces, points = np.array(row["witness_forces_n"]), np.array(row["contact_points_m"])
        arms = points - points.mean(axis=0)
        size = np.linalg.norm(arms, axis=1).max()
        assert np.abs(forces.sum(axis=0)).max() <= 1e-6
        assert np.abs(np.cross(arms, forces).sum(axis=0)).max() <= 1e-6 * size
        pushes = np.einsum("ki,ki->k", forces, np.array(row["contact_normals"]))
        assert pushes.sum() == pytest.approx(1.0, abs=1e-6)


def test_margins_follow_from_the_trials(grasps, learned):
    trials = rows_of(learned, "executions")
    rows = [row for row in grasps if row["executed"]]
    assert rows
    for row in rows:
        own = [each for each in trials if each["grasp_id"] == row["grasp_id"]]
        assert row["predicted_loss"] == min(each["predicted_loss"] for each in own)
        assert row["payload_kg"] == row["load_multiple"] * row["mass_kg"]
        assert row["tip_radius_m"] > 0.0
        assert [each["seed"] for each in own] == [None, 0, 0, 7, 7]
        assert [each["name"] for each in own][1:] == [f"misplaced {i}" for i in range(4)]
    unlike = [each["slip_m"] for each in trials if each["grasp_id"] == rows[0]["grasp_id"]]
    assert len(set(unlike)) == len(unlike)


def test_the_least_squeeze_is_no_stronger_than_the_best_one_needs(grasps):
    rows = [row for row in grasps if row["least_push_n"] is not None]
    assert rows
    for row in rows:
        pushes = np.einsum(
            "ki,ki->k", np.array(row["least_squeeze_n"]), np.array(row["contact_normals"])
        )
        assert (pushes <= row["least_push_n"] * (1.0 + 1e-9)).all()
        if row["load_multiple"] >= 1.0:
            assert row["least_push_n"] <= 10.0 * (1.0 + 1e-3)


def test_a_hand_stands_where_its_joints_say(grasps):
    """The fingertips of the stated angles lie on the object, at contacts in force closure."""
    hand = gc.load_hand("leap")
    assert {row["hand_reached"] for row in grasps if row["force_closed"]} == {True, False}
    assert {row["hand_reached"] for row in grasps if not row["force_closed"]} == {None}
    reached = [row for row in grasps if row["hand_reached"]]
    for row in reached:
        body = BODIES[row["object_id"]]
        found = places(hand, row["hand_joints_rad"], np.array(row["T_object_palm_m"]))
        points, normals = np.array(row["hand_points_m"]), np.array(row["hand_normals"])
        for finger, point, normal in zip(row["hand_fingers"], points, normals, strict=True):
            last = hand.links.index(hand.fingers[finger].links[-1])
            corners, rounding = hand.fingers[finger].tip.core
            placed = found.link_positions[0, last] + corners @ found.link_rotations[0, last].T
            ahead = (placed - point) @ normal
            assert ahead.max() == pytest.approx(-rounding, abs=1e-5)
        corners = body.vertices[body.triangles]
        for point in points:
            away = nearest_on_triangles(corners, point) - point
            assert np.linalg.norm(away, axis=1).min() <= 1e-5
        assert gc.force_closure(points, normals, row["friction"]).closed
        assert sorted(row["hand_fingers"]) == [0, 1, 2, 3]


@pytest.mark.parametrize(
    ("cells", "message"),
    [
        ({"span_angle_rad": 0.5}, "span_angle_rad is 0.5, but "),
        ({"smallest_singular_value": None}, "smallest_singular_value is None, but"),
        ({"witness_forces_n": [[0.1] * 3] * 4}, "no balanced forces"),
        ({"payload_kg": 9.0}, "by load_multiple times the mass"),
        ({"predicted_loss": 9.0}, "predicted_loss is 9.0, but"),
        ({"least_push_n": 0.01}, "least_push_n is 0.01, but the squeeze is not proved"),
        ({"hand_joints_rad": [9.0] * 16}, "not within the ranges of the joints"),
        ({"hand_joints_rad": [0.3] * 16}, "do not touch the object at hand_points_m"),
        ({"T_object_palm_m": np.eye(4).tolist()}, "overlaps the object or itself"),
        ({"T_object_palm_m": (2.0 * np.eye(4)).tolist()}, "T_object_palm_m is not a rigid motion"),
        ({"hand_normals": [[0.0, 0.0, 1.0]] * 4}, "hand_normals not its normals there"),
        ({"hand_fingers": [0, 1, 2, 7]}, "not 4 of the hand's 4"),
        ({"hand_reached": False}, "hand_reason is '', but hand_reached is False"),
        ({"hand_approach": [0.0, 0.0, 2.0]}, "hand_approach is not of unit length"),
        ({"hand_points_m": [[0.0] * 3] * 4}, "hand_points_m are not proved to be in force closure"),
    ],
)
def test_forged_figures_are_named(spoiled, cells, message):
    def change(rows):
        next(row for row in rows if row["executed"] and row["hand_reached"]).update(cells)

    forged(spoiled, "grasps", change)
    assert any(message in fault for fault in verify(spoiled))


def test_a_hand_in_free_air_is_named(spoiled):
    """The whole hand is moved away with its contacts, so that only the object is not where it
    was."""

    def change(rows):
        row = next(row for row in rows if row["hand_reached"])
        row["T_object_palm_m"][0][3] += 0.5
        row["hand_points_m"] = [[x + 0.5, y, z] for x, y, z in row["hand_points_m"]]

    forged(spoiled, "grasps", change)
    assert any("hand_points_m are not on the object" in fault for fault in verify(spoiled))
