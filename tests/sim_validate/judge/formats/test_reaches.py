"""The reached poses of `reaches.json` are read as they are in it."""

import json

import numpy as np
import pytest

from sim_validate.hands.dexgraspbench import hand_file
from sim_validate.judge.records import BadRecord
from tests.scenes.drawing.standing import reaches_text, standing
from tests.sim_validate.judge.recorded import records


def test_poses_that_are_reached_are_read(tmp_path):
    body, grasp, hand, reach = standing()
    (tmp_path / "reaches.json").write_text(reaches_text())
    (found,) = records(tmp_path)
    assert (found.id, found.object, found.scale) == (f"reaches.json#{grasp.id}", body.name, 1.0)
    assert found.joint_names == tuple(joint.name for joint in hand.joints)
    assert found.grasp.root @ hand_file(hand).root == pytest.approx(reach.palm_pose)
    assert found.grasp.joints == pytest.approx(reach.joints)
    assert (found.pregrasp is None) == (reach.pregrasp is None)
    assert found.axes.tolist() == np.eye(3).tolist()


@pytest.mark.parametrize(
    ("change", "said"),
    [({"schema": 99}, "schema"), ({"friction": -1.0}, "friction"), ({"reaches": 3}, "reaches"),
     ({"hand": None}, "hand")],
    ids=str,
)  # fmt: skip
def test_a_file_that_contradicts_itself_is_refused(change, said, tmp_path):
    (tmp_path / "reaches.json").write_text(json.dumps(json.loads(reaches_text()) | change))
    (found,) = records(tmp_path)
    assert isinstance(found, BadRecord)
    assert (found.id, said in found.reason) == ("reaches.json", True)


def test_poses_of_a_hand_from_a_file_have_no_root(tmp_path):
    file = json.loads(reaches_text())
    file["hand"]["name"] = "mine"
    file["reaches"] = [each | {"hand": "mine"} for each in file["reaches"]]
    (tmp_path / "reaches.json").write_text(json.dumps(file))
    (found,) = records(tmp_path)
    assert "is from a file, in which these poses of its palm cannot be placed" in found.reason
