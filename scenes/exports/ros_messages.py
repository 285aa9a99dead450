"""Makes ROS messages about an object and its grasps, as dictionaries with the messages' fields.

A moveit_msgs/Grasp is meant for one hand, so the four fingertips are taken as one: the hand's frame
is parallel to the object's and stands at the mean of the contacts, and the joints `fingerI_x`,
`fingerI_y` and `fingerI_z` slide the centre of fingertip I along its axes. `grasp_posture` has
their places where the fingertips touch and balanced efforts whose normal parts add up to one
newton; `pre_grasp_posture` has their places where the fingers have drawn back. The approach and the
retreats of a Grasp are those of a whole hand, and have length zero. Fields that are left out keep
their defaults.

Source:
    moveit_msgs/msg/Grasp.msg and GripperTranslation.msg (github.com/moveit/moveit_msgs);
    grasping_msgs/msg/GraspableObject.msg and Object.msg (github.com/mikeferguson/grasping_msgs).
"""

from typing import Any

import numpy as np

from grasp_core.arrays import Array
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import FINGERS
from scenes.exports.placed_grasps import PlacedGrasp

Message = dict[str, Any]
JOINTS = tuple(f"finger{finger}_{axis}" for finger in range(FINGERS) for axis in "xyz")
MOTIONS = ("pre_grasp_approach", "post_grasp_retreat", "post_place_retreat")


def graspable_object(body: Polyhedron, grasps: tuple[PlacedGrasp, ...]) -> Message:
    """Return a grasping_msgs/GraspableObject: an object with a moveit_msgs/Grasp for each grasp."""
    return {"object": _object(body), "grasps": [_grasp(body.name, placed) for placed in grasps]}


def _object(body: Polyhedron) -> Message:
    mesh = {
        "triangles": [{"vertex_indices": corners} for corners in body.triangles.tolist()],
        "vertices": [_xyz(vertex) for vertex in body.vertices],
    }
    return {
        "header": {"frame_id": body.name},
        "name": body.name,
        "properties": [{"name": "content_sha256", "value": body.content_sha256}],
        "meshes": [mesh],
        "mesh_poses": [_pose(np.zeros(3))],
    }


def _grasp(frame: str, placed: PlacedGrasp) -> Message:
    grasp = placed.grasp
    hand = grasp.positions.mean(axis=0)
    touching = placed.rods[:, :3, 3] - hand
    away = touching - placed.rod_length * placed.rods[:, :3, 2]
    efforts = {"effort": grasp.witness.forces.ravel().tolist()}
    return {
        "id": grasp.id,
        "pre_grasp_posture": _posture(away, {}),
        "grasp_posture": _posture(touching, efforts),
        "grasp_pose": {"header": {"frame_id": frame}, "pose": _pose(hand)},
        "grasp_quality": grasp.ferrari_canny[0],
        **{name: _no_motion(frame) for name in MOTIONS},
    }


def _posture(centers: Array, more: Message) -> Message:
    """Return a trajectory_msgs/JointTrajectory of one point, for centres of fingertips (4, 3)."""
    point = {"positions": centers.ravel().tolist(), **more}
    return {"joint_names": list(JOINTS), "points": [point]}


def _no_motion(frame: str) -> Message:
    """Return a moveit_msgs/GripperTranslation of length zero."""
    still = {"header": {"frame_id": frame}, "vector": _xyz(np.zeros(3))}
    return {"direction": still, "desired_distance": 0.0, "min_distance": 0.0}


def _pose(place: Array) -> Message:
    """Return a geometry_msgs/Pose that is not turned."""
    return {"position": _xyz(place), "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}}


def _xyz(vector: Array) -> Message:
    x, y, z = vector.tolist()
    return {"x": x, "y": y, "z": z}
