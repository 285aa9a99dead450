"""Recorded grasps have sizes that hands have, and joints that fit each other."""

import numpy as np
import pytest

from grasp_core.errors import InputError
from sim_validate.judge.records import ContactRecord, HandRecord, Posture

HERE = np.eye(4)


def record(**other):
    fields = {"id": "a.npy#0", "object": "mug", "scale": 0.1, "joint_names": ("a", "b"),
              "grasp": Posture(HERE, np.zeros(2)), "pregrasp": None, "squeeze": None,
              "axes": np.eye(3)}  # fmt: skip
    return HandRecord(**fields | other)


def test_a_record_keeps_what_it_is_given():
    found = record(squeeze=Posture(HERE, np.ones(2)))
    assert (found.object, found.joint_names, found.pregrasp) == ("mug", ("a", "b"), None)
    assert found.squeeze.joints.tolist() == [1.0, 1.0]
    assert record(joint_names=()).joint_names == ()
    assert repr(found) == "HandRecord(a.npy#0, mug, joints=2)"


@pytest.mark.parametrize(
    ("change", "said"),
    [({"object": ""}, "object"), ({"object": "mug\x1b[2J"}, "object must be text that can be"),
     ({"object": "x" * 2000}, "object"), ({"object": 3}, "object"), ({"scale": 0.0}, "scale"),
     ({"scale": float("nan")}, "scale"), ({"scale": -1.0}, "scale"), ({"scale": 1e9}, "scale"),
     ({"joint_names": ("a",)}, "must be 2 different names"),
     ({"joint_names": ("a", "a")}, "must be 2 different names"),
     ({"joint_names": ("a", "b", "a")}, "must be 2 different names"),
     ({"joint_names": ("a", "\n")}, "joint_names"),
     ({"pregrasp": Posture(HERE, np.zeros(3))}, "pregrasp must have the 2 joints"),
     ({"squeeze": Posture(HERE, np.zeros(1))}, "squeeze must have the 2 joints"),
     ({"axes": 2.0 * np.eye(3)}, "axes"), ({"axes": np.diag([1.0, 1.0, -1.0])}, "axes")],
    ids=str,
)  # fmt: skip
def test_a_wrong_record_is_refused(change, said):
    with pytest.raises(InputError, match=said):
        record(**change)


@pytest.mark.parametrize(
    ("root", "joints", "said"),
    [(HERE, [90.0], "joints must be radians from"), (HERE, [], "joints"),
     (HERE, [0.0] * 101, "joints"), (HERE, [float("nan")], "joints"), (np.eye(3), [0.0], "root"),
     (HERE + 1e-6 * np.eye(4), [0.0], "root must be a pose"),
     (np.diag([1.0, 1.0, -1.0, 1.0]), [0.0], "root must be a pose"),
     (np.vstack([HERE[:3], [[0, 0, 1, 1]]]), [0.0], "root must be a pose"),
     (HERE + np.outer([0, 11.0, 0, 0], [0, 0, 0, 1]), [0.0], "within 10 m of the object")],
    ids=str,
)  # fmt: skip
def test_a_wrong_posture_is_refused(root, joints, said):
    with pytest.raises(InputError, match=said):
        Posture(root, np.array(joints))


def test_contacts_are_two_or_more():
    with pytest.raises(InputError, match="contacts"):
        ContactRecord("a", "mug", 1.0, ())
