"""Figures and kinds of varied grasps are what they say, and forged ones are named."""

import math
from collections import Counter

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.closure.contacts import stacked
from grasp_core.errors import UnfaithfulError
from grasp_core.hands.hand_arrays import places
from grasp_core.objects.on_faces import nearest_on_triangles
from grasp_core.values import Contact, ContactRegion
from scenes.example_objects import example_object
from sim_validate.closure.validate import validate
from sim_validate.datasets import learning as varied_figures
from sim_validate.datasets.config import Learning
from sim_validate.datasets.learning import VARIED_RATIOS, execution_cells, region_exit, variants
from sim_validate.datasets.making_rows import UnitRows
from sim_validate.datasets.verify import verify
from sim_validate.datasets.work_units import units_of
from sim_validate.engine.setup import Agenda
from tests.sim_validate.datasets.configs import BODIES, LEARNED, rows_of
from tests.sim_validate.datasets.forging import first, forged

WEDGE = example_object("wedge")
KINDS = {*VARIED_RATIOS, "moved_out"}


@pytest.fixture(scope="module")
def grasps(learned):
    return rows_of(learned, "grasps")


@pytest.fixture(scope="module")
def by_id(grasps):
    return {row["grasp_id"]: row for row in grasps}


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


def test_proved_chances_of_closure_are_those_of_the_grasps(grasps):
    assert {row["closed_share"] is None for row in grasps} == {True, False}
    assert {row["kind"] for row in grasps} >= {"planned", "friction_above"}
    for row in grasps:
        assert (row["closed_share"] is not None) == row["force_closed"]
        if row["kind"] == "planned":
            body = BODIES[row["object_id"]]
            (grasp,) = gc.plan(body, row["friction"], families="concurrent", limit=1).grasps
            found = gc.placement_probability(
                body, grasp, row["friction"], pose_sigma_m=2e-3, pose_sigma_rad=math.radians(2.0)
            )
            assert row["closed_share"] == found.lower > 0.5


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
        assert [each["seed"] for each in own] == [None, 0, 7]
        assert [each["name"] for each in own][1:] == [f"misplaced {i}" for i in range(2)]
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
        ({"hand_approach": [0.0, 0.0, 2.0]}, "hand_approach must have length 1"),
        ({"hand_points_m": [[0.0] * 3] * 4}, "hand_points_m are not proved to be in force closure"),
    ],
)
def test_forged_figures_are_named(spoiled, cells, message):
    forged(spoiled, "grasps", first(lambda row: row["executed"] and row["hand_reached"], **cells))
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


def varied(by_id, kind):
    found = [row for row in by_id.values() if row["kind"] == kind]
    assert found
    return found


def test_every_kind_that_is_asked_for_has_rows(by_id):
    kinds = Counter(row["kind"] for row in by_id.values())
    assert kinds["planned"] == len(LEARNED.objects)
    assert set(kinds) >= KINDS
    synthetic = [row for row in by_id.values() if row["control_of"] is not None]
    assert len(synthetic) == len(LEARNED.objects) * LEARNED.learning.synthetic
    assert all(row["kind"] == row["label"] for row in synthetic)


def test_frictions_are_below_near_and_above_the_critical_one_of_the_contacts(by_id):
    for kind in ("friction_below", "friction_near", "friction_above"):
        for row in varied(by_id, kind):
            critical = gc.critical_friction(row["contact_points_m"], row["contact_normals"])
            assert row["friction_ratio"] == pytest.approx(row["friction"] / critical, rel=1e-6)
            least, most = VARIED_RATIOS[kind]
            assert least - 1e-3 <= row["friction_ratio"] <= most + 1e-3
            assert row["force_closed"] == (row["friction"] > critical)
            assert row["contact_points_m"] == by_id[row["made_from"]]["contact_points_m"]


def test_moved_contacts_are_out_of_the_regions_of_a_plan_and_on_its_faces(by_id):
    plans = {
        name: gc.plan(body, 0.5, families=("concurrent",), limit=1).grasps[0]
        for name, body in BODIES.items()
    }
    moved = 0
    for row in varied(by_id, "moved_out"):
        grasp = plans[row["object_id"]]
        points = np.array(row["contact_points_m"])
        assert row["displaced_m"] == pytest.approx(
            np.linalg.norm(points - grasp.positions, axis=1), abs=1e-15
        )
        for finger in np.flatnonzero(row["displaced_m"]):
            way = points[finger] - grasp.positions[finger]
            way /= np.linalg.norm(way)
            exit_m = region_exit(grasp.regions[finger], grasp.contacts[finger], way)
            assert row["region_exit_m"][finger] == pytest.approx(exit_m, rel=1e-6)
            assert row["displaced_m"][finger] > exit_m
            moved += 1
    assert moved >= 2


def test_masses_are_near_the_one_that_is_predicted_to_be_lost(by_id, learned):
    losses = {row["grasp_id"]: row for row in rows_of(learned, "executions")}
    for row in varied(by_id, "mass_near"):
        source = by_id[row["made_from"]]
        assert row["contact_points_m"] == source["contact_points_m"]
        least, most = VARIED_RATIOS["mass_near"]
        assert least <= row["mass_ratio"] <= most
        assert row["grasp_id"] in losses
        assert row["mass_kg"] > 0.0


def test_natural_negatives_are_closed_and_lose_their_object(by_id):
    assert any(
        row["force_closed"] and row["survived"] is False and row["kind"] in KINDS
        for row in by_id.values()
    )
    assert any(row["survived"] and row["kind"] in KINDS for row in by_id.values())


@pytest.mark.slow
def test_a_whole_dataset_has_no_fault_and_comes_out_the_same_again(learned):
    assert verify(learned, 1.0) == []


@pytest.mark.parametrize(
    ("kind", "cells", "message"),
    [
        ("planned", {"kind": "given"}, "kind is given, but planned by label"),
        ("friction_near", {"made_from": "x"}, "named in made_from, has no row"),
        ("friction_near", {"friction_ratio": 2.0}, "friction_ratio is 2.0, but"),
        ("friction_near", {"kind": "friction_above"}, "is none of the kind friction_above"),
        ("moved_out", {"displaced_m": [0.0] * 4}, "by the contacts of made_from"),
        ("moved_out", {"region_exit_m": [1.0] * 4}, "is still in its region"),
    ],
)
def test_forged_kinds_are_named(spoiled, kind, cells, message):
    forged(spoiled, "grasps", first(lambda row: row["kind"] == kind, **cells))
    assert any(message in fault for fault in verify(spoiled))


def test_draws_depend_on_the_seed_and_not_on_what_else_is_asked_for():
    (grasp,) = gc.plan(WEDGE, 0.5, families=("concurrent",), limit=1).grasps
    alone = list(variants(WEDGE, grasp, 0.5, Learning(moved_out=1), 0))
    many = list(variants(WEDGE, grasp, 0.5, Learning(friction_near=3, moved_out=2), 0))
    other = list(variants(WEDGE, grasp, 0.5, Learning(moved_out=1), 1))
    first = next(each for each in many if each.name == "moved_out-0")
    assert len(alone) == len(other) == 1
    assert np.array_equal(alone[0].cells["displaced_m"], first.cells["displaced_m"])
    assert not np.array_equal(alone[0].cells["displaced_m"], other[0].cells["displaced_m"])


def test_a_varied_grasp_beyond_the_simulator_leaves_the_others(monkeypatch):
    def unfaithful(*_, **__):
        raise UnfaithfulError("the simulator is not faithful here")

    (grasp,) = gc.plan(WEDGE, 0.5, families=("concurrent",), limit=1).grasps
    (variant,) = variants(WEDGE, grasp, 0.5, Learning(moved_out=1), 0)
    unit = next(unit for unit in units_of(LEARNED) if unit.object == WEDGE.name)
    verdict = validate(WEDGE, grasp, 0.5, agenda=Agenda(controls=False))
    monkeypatch.setattr(varied_figures, "execute", unfaithful)
    tried = UnitRows(unit, WEDGE)._tried_variant(variant, verdict)
    assert tried.executed == "the simulator is not faithful here"
    assert execution_cells(tried.executed)["executed"] is False
    assert "survived" not in execution_cells(tried.executed)


def test_a_square_region_ends_at_its_side():
    """Half the side straight ahead, and the root of two times that on the diagonal."""
    corners = np.array([[1.0, 1.0, 0.0], [-1.0, 1.0, 0.0], [-1.0, -1.0, 0.0], [1.0, -1.0, 0.0]])
    square = ContactRegion("cone", corners, 1.0)
    contact = Contact(np.zeros(3), np.array([0.0, 0.0, 1.0]))
    assert region_exit(square, contact, np.array([1.0, 0.0, 0.0])) == pytest.approx(1.0, abs=1e-12)
    diagonal = np.array([1.0, 1.0, 0.0]) / np.sqrt(2.0)
    assert region_exit(square, contact, diagonal) == pytest.approx(np.sqrt(2.0), abs=1e-12)
    point = ContactRegion("point", corners[:1], 0.0)
    assert region_exit(point, contact, diagonal) == 0.0
