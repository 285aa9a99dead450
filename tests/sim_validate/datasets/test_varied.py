"""Varied grasps are what their kinds say, and forged ones are named."""

from collections import Counter

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.errors import UnfaithfulError
from grasp_core.values import Contact, ContactRegion
from scenes.example_objects import example_object
from sim_validate.closure.validate import validate
from sim_validate.datasets import learning as varied_figures
from sim_validate.datasets.config import Learning, config_from_toml
from sim_validate.datasets.learning import RATIOS, execution_cells, region_exit, variants
from sim_validate.datasets.units import Making, units_of
from sim_validate.datasets.verify import verify
from sim_validate.engine.setup import Agenda
from tests.sim_validate.datasets.configs import BODIES, LEARNED, rows_of
from tests.sim_validate.datasets.forging import forged

WEDGE = example_object("wedge")
KINDS = {*RATIOS, "moved_out"}


@pytest.fixture(scope="module")
def by_id(learned):
    return {row["grasp_id"]: row for row in rows_of(learned, "grasps")}


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
            least, most = RATIOS[kind]
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
        least, most = RATIOS["mass_near"]
        assert least <= row["mass_ratio"] <= most
        assert row["grasp_id"] in losses
        assert row["mass_kg"] > 0.0


def test_natural_negatives_are_closed_and_lose_their_object(by_id):
    assert any(
        row["force_closed"] and row["survived"] is False and row["kind"] in KINDS
        for row in by_id.values()
    )
    assert any(row["survived"] and row["kind"] in KINDS for row in by_id.values())


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
    def change(rows):
        next(row for row in rows if row["kind"] == kind).update(cells)

    forged(spoiled, "grasps", change)
    assert any(message in fault for fault in verify(spoiled))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[learning]\nmoved_in = 1", "no setting is named"),
        ("[learning]\nmass_near = 1", "only executed grasps have a mass"),
        ("[learning]\nseeds = [1, 1]", "seeds: expected different items"),
    ],
)
def test_settings_out_of_range_are_refused(tmp_path, text, message):
    path = tmp_path / "c.toml"
    path.write_text(f'objects = ["wedge"]\n{text}\n', encoding="utf-8")
    with pytest.raises(gc.InputError, match=message):
        config_from_toml(path)


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
    """The row says why its survival is not known."""

    def unfaithful(*_, **__):
        raise UnfaithfulError("the simulator is not faithful here")

    (grasp,) = gc.plan(WEDGE, 0.5, families=("concurrent",), limit=1).grasps
    (variant,) = variants(WEDGE, grasp, 0.5, Learning(moved_out=1), 0)
    unit = next(unit for unit in units_of(LEARNED) if unit.object == WEDGE.name)
    verdict = validate(WEDGE, grasp, 0.5, agenda=Agenda(controls=False))
    monkeypatch.setattr(varied_figures, "execute", unfaithful)
    tried = Making(unit, WEDGE).varied(variant, verdict)
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
