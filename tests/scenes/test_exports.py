"""Exported grasps, read back by other readers than their writers, are where the plan has them."""

import json
import struct
from dataclasses import replace

import numpy as np
import pytest
import trimesh

import grasp_core as gc
import scenes
from scenes.exports import ROD_LENGTH

SAME = {"rtol": 0.0, "atol": 1e-12}
"""For numbers of 64 bits about objects of a tenth of a metre, whose rounding is 1e-17."""
SINGLE = 1e-7
"""Relative rounding of the numbers of 32 bits in which vertices are kept: 2^-24, rounded up."""


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
    """Path of the exported plan."""
    return scenes.export_grasps(plan, tmp_path / "grasps.glb")


def json_of(glb):
    """The JSON part of a GLB file, by its specification: a head of 12 bytes, then a chunk."""
    assert glb[:4] == b"glTF"
    (length,) = struct.unpack_from("<I", glb, 12)
    return json.loads(glb[20 : 20 + length])


def glb_pose(node):
    return np.array(node.get("matrix", np.eye(4).ravel())).reshape(4, 4).T


def test_gltf_nodes_stand_at_the_contacts_with_every_digit(plan, written):
    tree = json_of(written.read_bytes())
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
    read = trimesh.load_scene(written)
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


def test_without_planned_fingers_they_come_along_the_normals(tmp_path):
    plan = gc.plan(scenes.example_object("tetrahedron"), 0.5, limit=1)
    path = scenes.export_grasps(plan, tmp_path / "a.glb")
    read = trimesh.load_scene(path)
    rod, bar = read.graph.get("grasp_0_finger_2_rod")
    np.testing.assert_allclose(rod[:3, 2], plan[0].normals[2], **SAME)
    length = np.ptp(read.geometry[bar].vertices[:, 2])
    assert length == pytest.approx(ROD_LENGTH * plan.body.radius, rel=SINGLE)
