"""A reader of Isaac grasp files by the published format, and of where they put a hand."""

from dataclasses import dataclass

import numpy as np

TOP = ["format", "format_version", "object_frame", "gripper_frame", "grasps"]
OF_A_GRASP = [
    "confidence", "position", "orientation", "cspace_position", "pregrasp_cspace_position",
]  # fmt: skip


@dataclass
class ReadGrasp:
    """A grasp of a file."""

    confidence: float
    pose: np.ndarray  # the gripper's frame in the object's, (4, 4)
    joints: dict
    open_joints: dict


def read_isaac(path):
    """The frames' names and the grasps of a file, all of whose keys must be those published."""
    import yaml

    found = yaml.safe_load(path.read_text(encoding="utf-8"))
    assert list(found) == TOP
    assert (found["format"], found["format_version"]) == ("isaac_grasp", 1.0)
    grasps = {name: read_grasp(each) for name, each in found["grasps"].items()}
    return found["object_frame"], found["gripper_frame"], grasps


def read_grasp(found):
    assert list(found) == OF_A_GRASP
    assert set(found["orientation"]) == {"w", "xyz"}
    joints, opened = found["cspace_position"], found["pregrasp_cspace_position"]
    assert list(joints) == list(opened)
    w, (x, y, z) = found["orientation"]["w"], found["orientation"]["xyz"]
    numbers = [found["confidence"], w, x, y, z, *found["position"], *joints.values(),
               *opened.values()]  # fmt: skip
    assert all(type(each) is float for each in numbers)
    assert abs(w * w + x * x + y * y + z * z - 1.0) < 1e-15  # roundings of squares up to one
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    pose = np.eye(4)
    pose[:3, :3] += 2.0 * w * cross + 2.0 * cross @ cross
    pose[:3, 3] = found["position"]
    return ReadGrasp(found["confidence"], pose, joints, opened)


def turned(axis, angle):
    """The rotation about a unit vector, by Rodrigues' formula."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross


def last_link(record, finger, grasp):
    """Pose of a finger's last link in the object's frame, along the joints of a hand's record."""
    pose = grasp.pose
    for link in record["fingers"][finger]["links"]:
        joint, step = link["joint"], np.eye(4)
        step[:3, :3] = np.array(joint["rotation"]) @ turned(
            joint["axis"], grasp.joints[joint["name"]]
        )
        step[:3, 3] = joint["position_m"]
        pose = pose @ step
    return pose
