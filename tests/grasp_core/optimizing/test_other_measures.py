"""The best grasps for the weight and for tasks, against definitions, closed forms and tampering."""

from dataclasses import replace

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.optimizing.contact_places import exact_maps, grounds_of
from grasp_core.optimizing.support_cuts import MEASURE_ROUNDING, read_proof, write_proof
from grasp_core.quality.measures import Measure
from scenes.example_objects import example_object
from tests.grasp_core.optimizing.contacts_on_faces import FRICTION, LIFT, best

CLOSED_FORM = 1.0 / 3.0 + FRICTION * np.sqrt(8.0 / 9.0)
"""Forces along the normals at the middles of the faces of a regular tetrahedron make a hull with a
ball of radius 1/3. In the direction against a normal no contact of the other faces pushes more than
1/3, and friction adds the sine of the angle between them, which no torque can raise."""


def loosely_bounded():
    return best("tetrahedron", "weight", 0.3)


@pytest.mark.parametrize("measure", ["weight", "ferrari-canny"])
def test_a_regular_tetrahedron_is_held_by_what_its_normals_say(measure):
    found = loosely_bounded() if measure == "weight" else best("tetrahedron", measure, 0.1, jobs=2)
    assert found.quality.lower <= CLOSED_FORM
    assert found.verify()
    if measure == "weight":
        assert found.quality.lower >= 1.0 / 3.0
        assert found.bound <= 1.01 * CLOSED_FORM


@pytest.mark.parametrize(
    "changed", [{"measure": "volume"}, {"measure": "ferrari-canny"}, {"measure": "task"},
                {"loads": np.ones((1, 6))}, {"loads": np.ones(6)}, {"schema": 3}],
)  # fmt: skip
def test_files_with_other_loads_are_refused(changed, tmp_path):
    path = write_proof(tmp_path / "proof.npz", loosely_bounded().proof)
    with np.load(path) as archive:
        arrays = dict(archive) | changed
    np.savez(path, **arrays)
    with pytest.raises(gc.InputError):
        read_proof(path)


def test_a_task_keeps_only_the_symmetries_that_it_has():
    body = example_object("box")
    grounds = grounds_of(body, 0.05 * body.radius)
    down, turning = np.zeros((1, 6)), np.zeros((1, 6))
    down[0, 2], turning[0, 5] = -1.0, 1.0
    # of eight maps of a box, four keep a direction along an axis; of these the two reflections
    # turn a torque about the axis round
    assert len(exact_maps(body, grounds)) == 8
    assert len(exact_maps(body, grounds, Measure("weight"))) == 8
    assert len(exact_maps(body, grounds, Measure("task", down))) == 4
    assert len(exact_maps(body, grounds, Measure("task", np.vstack([down, turning])))) == 2
    found = best("box", "task", 0.8)
    every = exact_maps(body, grounds)
    assert len(every) > len(found.proof.maps)
    assert not replace(found.proof, maps=every).verify()


def test_twists_that_ask_for_nothing_leave_room_for_rounding():
    """Support zero is an answer to a twist without a force, and minus the rounding still is."""
    found = loosely_bounded()
    proof = found.proof
    at = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0])
    ask = replace(
        proof, deeds=np.zeros(1, int), asked=np.zeros(1, int), twists=at[None], maps=np.eye(3)[None]
    )
    assert not ask.verify()
    answers = ask.threshold * ask.measure.demands(ask.twists) - ask.slack.lowered
    assert answers == pytest.approx([-(1.0 + FRICTION) * MEASURE_ROUNDING], rel=1e-12)
    assert ask.bound == ask.threshold


@pytest.mark.parametrize(
    "changed",
    [{"measure": "task"}, {"measure": "weight", "wrenches": LIFT},
     {"measure": "task", "wrenches": LIFT[0]}, {"measure": "task", "wrenches": LIFT[:0]}],
)  # fmt: skip
def test_wrenches_that_do_not_fit_the_measure_are_refused(changed):
    with pytest.raises(gc.InputError, match="wrenches"):
        gc.best_grasp(example_object("tetrahedron"), FRICTION, **changed)
