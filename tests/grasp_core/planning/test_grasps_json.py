import json
from dataclasses import replace

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.planning.grasps_json import RecordedObject, grasps_from_json, plan_to_json
from grasp_core.planning.result import Plan
from scenes.example_objects import example_object
from tests.damaged import check_refused, optional_keys, value_at


@pytest.fixture(scope="module")
def text():
    body = example_object("wedge")
    return plan_to_json(body, gc.plan(body, 0.5, limit=2))


def test_the_ways_of_planned_fingers_survive_the_file():
    body = example_object("l-bracket")
    plan = gc.plan(body, 0.5, limit=1, finger=gc.Finger(0.004, 0.05))
    ways = np.eye(3)[[0, 1, 2, 0]]
    plan = replace(plan, grasps=(replace(plan.grasps[0], approach_directions=ways),))
    saved = grasps_from_json(plan_to_json(body, plan))
    assert saved.finger == gc.Finger(0.004, 0.05)
    np.testing.assert_array_equal(saved.grasps[0].approach_directions, ways)


def test_every_damaged_field_is_refused_by_its_name(text):
    document = json.loads(text)
    check_refused(
        grasps_from_json, document | {"grasps": document["grasps"][:1]},
        optional=(optional_keys(RecordedObject) | optional_keys(Plan)) - {"versions"},
        loose={"versions", "families"}, large={"critical_friction"},
    )  # fmt: skip


FIRST = ("grasps", 0)
CHANGES = {
    "schema from the future": (("schema",), 3, "got 3: a newer graspproof"),
    "schema of before": (("schema",), 1, "got 1: an older graspproof"),
    "mesh of another object": (("object", "content_sha256"), 64 * "0", "content"),
    "an approach that is no direction": (
        (*FIRST, "approach_directions"), [[0.0, 0.0, 0.5]] * 4, "approach_directions"),
    "three contacts": ((*FIRST, "contacts", 3), None, "contacts"),
    "contact off its face": ((*FIRST, "contacts", 0, "position_m", 0), 0.5, "face"),
    "witness outside its cone": ((*FIRST, "witness", "forces", 0), [0.1, 0.1, 0.1], "witness"),
    "focus beside the lines": ((*FIRST, "focus_points_m", 0), [0.01, 0.0, 0.0], "focus points"),
    "witness beside the contacts": (
        (*FIRST, "witness", "points_m", 0), [0.1, 0.1, 0.1], "witness lines do not pass"),
    "witness direction that is not its force's": (
        (*FIRST, "witness", "directions", 0), [1.0, 0.0, 0.0],
        "directions.* contradicts the other fields"),
    "another family": (
        (*FIRST, "family"), "regulus", "witness lines are concurrent, not regulus"),
    "id that is a path": ((*FIRST, "id"), "../../x", "id"),
    "no such face": ((*FIRST, "faces", 0), 99, "names face 99"),
}  # fmt: skip
COMPUTED = {
    "two equal ids": (lambda d: _set(d, ("grasps", 1, "id"), d["grasps"][0]["id"]), "same id"),
    "contact beyond the border": (lambda d: _slid(d, 0.05), "outside the border"),
    "witness out of balance": (
        lambda d: _scaled_forces(d, [1.1, 1.0, 1.0, 1.0]), "do not balance"),
    "witness so small that nothing seems out of balance": (
        lambda d: _scaled_forces(d, [1e-7, 1e-7, 2e-8, 5e-7], keep_sum=False),
        "do not sum to one"),
}  # fmt: skip


@pytest.mark.parametrize("case", [*CHANGES, *COMPUTED])
def test_changed_files_are_refused_by_field(text, case):
    document = json.loads(text)
    if case in CHANGES:
        *change, where = CHANGES[case]
        _set(document, *change)
    else:
        change, where = COMPUTED[case]
        change(document)
    with pytest.raises(gc.InputError, match=where):
        grasps_from_json(json.dumps(document))


def _slid(document, distance):
    """Move a contact along its face."""
    contact = document["grasps"][0]["contacts"][0]
    along = np.cross(contact["normal"], [0.3, 0.5, 0.7])
    moved = np.array(contact["position_m"]) + distance * along / np.linalg.norm(along)
    _set(document, (*FIRST, "contacts", 0, "position_m"), moved.tolist())


def _scaled_forces(document, factors, *, keep_sum=True):
    """Scale each witness force along itself, so that it stays in its cone."""
    grasp = document["grasps"][0]
    forces = np.array(grasp["witness"]["forces"]) * np.array(factors)[:, None]
    if keep_sum:
        normals = np.array([contact["normal"] for contact in grasp["contacts"]])
        forces /= np.einsum("ki,ki->", forces, normals)
    _set(document, (*FIRST, "witness", "forces"), forces.tolist())


def _set(document, path, value):
    value_at(document, path[:-1])[path[-1]] = value
