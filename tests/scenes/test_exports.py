"""Exported grasps, read back by other readers than their writers, are where the plan has them."""

import json
import struct
from dataclasses import replace

import numpy as np
import pytest
import trimesh
import yaml

import grasp_core as gc
import scenes
from scenes.exports import ROD_LENGTH

SAME = {"rtol": 0.0, "atol": 1e-12}
"""For numbers of 64 bits about objects of a tenth of a metre, whose rounding is 1e-17."""
SINGLE = 1e-7
"""Relative rounding of the numbers of 32 bits in which vertices are kept: 2^-24, rounded up."""
FILES = {"moveit": "grasps.yaml", "gltf": "grasps.glb"}


@pytest.fixture(scope="module")
def plan():
    """Grasps for planned fingers; those of the second do not come along the normals."""
    body, finger = scenes.example_object("l-bracket"), gc.Finger(radius_m=0.003, approach_m=0.03)
    plan = gc.plan(body, 0.5, limit=3, finger=finger)
    frames = plan[1].contact_frames()
    slanted = frames[:, :3, 2] + 0.5 * frames[:, :3, 0]
    slanted /= np.linalg.norm(slanted, axis=1, keepdims=True)
    second = replace(plan[1], approach_directions=slanted)
    return replace(plan, grasps=(plan[0], second, plan[2]))


def ways_in(grasp):
    return grasp.approach_poses()[:, :3, 2]


@pytest.fixture
def written(plan, tmp_path):
    """Path of the plan, exported in a format."""

    def write(to, **more):
        return scenes.export_grasps(plan, tmp_path / FILES[to], to, **more)

    return write


def json_of(glb):
    """The JSON part of a GLB file, by its specification: a head of 12 bytes, then a chunk."""
    assert glb[:4] == b"glTF"
    (length,) = struct.unpack_from("<I", glb, 12)
    return json.loads(glb[20 : 20 + length])


def glb_pose(node):
    return np.array(node.get("matrix", np.eye(4).ravel())).reshape(4, 4).T


def test_gltf_nodes_stand_at_the_contacts_with_every_digit(plan, written):
    tree = json_of(written("gltf").read_bytes())
    nodes = {node["name"]: node for node in tree["nodes"]}
    roots = [tree["nodes"][root]["name"] for root in tree["scenes"][tree["scene"]]["nodes"]]
    assert roots == ["grasp_0", "grasp_1", "grasp_2"]
    for number, grasp in enumerate(plan):
        named = nodes[f"grasp_{number}"]
        told = named["extras"]
        assert (told["id"], told["family"]) == (grasp.id, grasp.family)
        assert told["ferrari_canny_lower_n"] == grasp.ferrari_canny[0]
        assert told["critical_friction"] == grasp.critical_friction
        below = {tree["nodes"][child]["name"] for child in named["children"]}
        for finger, contact in enumerate(grasp.contacts):
            name = f"grasp_{number}_finger_{finger}"
            assert {name, f"{name}_rod", f"grasp_{number}_object"} <= below
            pose = glb_pose(nodes[name])
            np.testing.assert_allclose(pose[:3, 3], contact.position, **SAME)
            np.testing.assert_allclose(pose[:3, 2], contact.normal, **SAME)
            assert nodes[name]["extras"]["position_m"] == contact.position.tolist()
            assert nodes[name]["extras"]["normal"] == contact.normal.tolist()
            rod = glb_pose(nodes[f"{name}_rod"])
            np.testing.assert_allclose(rod[:3, 2], ways_in(grasp)[finger], **SAME)
            center = contact.position - 0.003 * contact.normal
            np.testing.assert_allclose(rod[:3, 3], center, **SAME)


def test_gltf_shapes_have_the_sizes_of_object_and_fingers(plan, written):
    read = trimesh.load_scene(written("gltf"))
    for number, grasp in enumerate(plan):
        offset, _ = read.graph.get(f"grasp_{number}")
        place, mesh = read.graph.get(f"grasp_{number}_object")
        np.testing.assert_array_equal(place, offset)
        vertices = np.asarray(read.geometry[mesh].vertices)
        np.testing.assert_allclose(vertices, plan.body.vertices, rtol=SINGLE, atol=1e-12)
        np.testing.assert_array_equal(read.geometry[mesh].faces, plan.body.triangles)
        for finger in range(4):
            pose, ball = read.graph.get(f"grasp_{number}_finger_{finger}")
            tip = trimesh.transform_points(read.geometry[ball].vertices, pose)
            center = grasp.positions[finger] - 0.003 * grasp.normals[finger] + offset[:3, 3]
            far = np.linalg.norm(tip - center, axis=1)
            np.testing.assert_allclose(far, 0.003, atol=SINGLE * 0.1)
            _, bar = read.graph.get(f"grasp_{number}_finger_{finger}_rod")
            low, high = read.geometry[bar].bounds
            np.testing.assert_allclose((low[2], high[2]), (-0.03, 0.0), atol=SINGLE)
            assert read.geometry[bar].is_watertight


MESSAGES = {
    "GraspableObject": {"object": "Object", "grasps": ["Grasp"]},
    "Object": {
        "header": "Header", "name": str, "support_surface": str, "properties": ["ObjectProperty"],
        "point_cluster": None, "primitives": None, "primitive_poses": ["Pose"],
        "meshes": ["Mesh"], "mesh_poses": ["Pose"], "surface": None,
    },
    "ObjectProperty": {"name": str, "value": str},
    "Grasp": {
        "id": str, "pre_grasp_posture": "JointTrajectory", "grasp_posture": "JointTrajectory",
        "grasp_pose": "PoseStamped", "grasp_quality": float,
        "pre_grasp_approach": "GripperTranslation", "post_grasp_retreat": "GripperTranslation",
        "post_place_retreat": "GripperTranslation", "max_contact_force": float,
        "allowed_touch_objects": [str],
    },
    "GripperTranslation": {
        "direction": "Vector3Stamped", "desired_distance": float, "min_distance": float,
    },
    "JointTrajectory": {
        "header": "Header", "joint_names": [str], "points": ["JointTrajectoryPoint"],
    },
    "JointTrajectoryPoint": {
        "positions": [float], "velocities": [float], "accelerations": [float], "effort": [float],
        "time_from_start": None,
    },
    "Mesh": {"triangles": ["MeshTriangle"], "vertices": ["Point"]},
    "MeshTriangle": {"vertex_indices": [int]},
    "PoseStamped": {"header": "Header", "pose": "Pose"},
    "Vector3Stamped": {"header": "Header", "vector": "Vector3"},
    "Header": {"stamp": None, "frame_id": str},
    "Pose": {"position": "Point", "orientation": "Quaternion"},
    "Quaternion": dict.fromkeys("xyzw", float),
    "Point": dict.fromkeys("xyz", float),
    "Vector3": dict.fromkeys("xyz", float),
}  # fmt: skip
"""Fields of messages of grasping_msgs 0.5, moveit_msgs, and the common ROS packages."""


def check_message(kind, value):
    """A value has only fields of its message, each of the type that the message demands."""
    if isinstance(kind, list):
        assert isinstance(value, list)
        for each in value:
            check_message(kind[0], each)
    elif isinstance(kind, str):
        assert set(value) <= set(MESSAGES[kind]), kind
        for name, each in value.items():
            check_message(MESSAGES[kind][name], each)
    else:
        assert type(value) is kind


def test_the_messages_have_no_fields_but_their_own(written):
    document = yaml.safe_load(written("moveit").read_text())
    assert set(document) == {"graspable_object", "fingertips"}
    check_message("GraspableObject", document["graspable_object"])


def test_messages_and_fingertips_say_where_the_fingers_are(plan, written):
    document = yaml.safe_load(written("moveit").read_text())
    (mesh,) = document["graspable_object"]["object"]["meshes"]
    vertices = [[point[axis] for axis in "xyz"] for point in mesh["vertices"]]
    np.testing.assert_array_equal(vertices, plan.body.vertices)
    corners = [each["vertex_indices"] for each in mesh["triangles"]]
    np.testing.assert_array_equal(corners, plan.body.triangles)
    messages = document["graspable_object"]["grasps"]
    for grasp, message, tips in zip(plan, messages, document["fingertips"], strict=True):
        assert message["id"] == tips["id"] == grasp.id
        assert message["grasp_quality"] == tips["ferrari_canny_lower_n"] == grasp.ferrari_canny[0]
        told = tips["contacts"]
        assert [each["position_m"] for each in told] == grasp.positions.tolist()
        assert [each["normal"] for each in told] == grasp.normals.tolist()
        assert [each["approach_direction"] for each in told] == ways_in(grasp).tolist()
        assert tips["fingertip_radius_m"] == 0.003
        hand = np.array([message["grasp_pose"]["pose"]["position"][axis] for axis in "xyz"])
        assert message["grasp_pose"]["header"]["frame_id"] == plan.body.name
        (touching,) = message["grasp_posture"]["points"]
        (away,) = message["pre_grasp_posture"]["points"]
        centers = np.reshape(touching["positions"], (4, 3)) + hand
        np.testing.assert_allclose(centers, grasp.positions - 0.003 * grasp.normals, **SAME)
        np.testing.assert_allclose(
            np.reshape(away["positions"], (4, 3)) + hand, centers - 0.03 * ways_in(grasp), **SAME
        )
        assert touching["effort"] == grasp.witness.forces.ravel().tolist()
        assert message["grasp_posture"]["joint_names"][4] == "finger1_y"


def test_without_planned_fingers_they_come_along_the_normals(tmp_path):
    plan = gc.plan(scenes.example_object("tetrahedron"), 0.5, limit=1)
    path = scenes.export_grasps(plan, tmp_path / "a.glb", "gltf")
    read = trimesh.load_scene(path)
    rod, bar = read.graph.get("grasp_0_finger_2_rod")
    np.testing.assert_allclose(rod[:3, 2], plan[0].normals[2], **SAME)
    length = np.ptp(read.geometry[bar].vertices[:, 2])
    assert length == pytest.approx(ROD_LENGTH * plan.body.radius, rel=SINGLE)


def test_a_missing_library_is_named_with_its_extra(plan, tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "yaml", None)
    with pytest.raises(gc.InputError, match=r"pip install 'graspproof\[moveit\]'"):
        scenes.export_grasps(plan, tmp_path / FILES["moveit"], "moveit")
    assert not list(tmp_path.iterdir())
