"""Poses of parallel grippers become contacts where the fingers would meet the object."""

import json

import h5py
import numpy as np
import pytest

import grasp_core as gc
import scenes
from grasp_core.errors import InputError
from sim_validate.peer_files.gripper_poses import (
    PANDA_END_M,
    GripperGrasp,
    load_acronym,
    load_graspnet,
)

SIDE = 0.04
BOX = gc.Polyhedron.from_mesh(
    SIDE * (scenes.example_object("box").vertices - scenes.example_object("box").center_of_mass)
    / np.ptp(scenes.example_object("box").vertices, axis=0),
    scenes.example_object("box").triangles, name="cube",
)  # fmt: skip
"""A cube with sides of 40 mm about its middle."""


def graspnet_row(score=0.8, width=0.08, depth=0.02, rotation=None, at=(0, 0, 0), number=5):
    turned = np.eye(3) if rotation is None else rotation
    return [score, width, 0.02, depth, *np.ravel(turned), *at, number]


def test_graspnets_fingers_meet_the_cube_across_the_palm(tmp_path):
    """The palm looks along x, the fingers stand across y; the line is 10 mm before their ends,
    which are 20 mm in front of the translation."""
    path = tmp_path / "grasps.npy"
    rows = np.array([graspnet_row(), graspnet_row(number=6)])
    np.save(path, rows)
    one, _ = load_graspnet(path)
    (only,) = load_graspnet(path, object_number=5)
    assert one == only
    assert (one.score, one.opening_m) == (0.8, 0.08)
    left, right = one.contacts(BOX)
    assert left.position == pytest.approx([0.01, -0.02, 0.0], abs=1e-12)
    assert right.position == pytest.approx([0.01, 0.02, 0.0], abs=1e-12)
    assert left.normal == pytest.approx([0.0, 1.0, 0.0], abs=1e-12)
    assert right.normal == pytest.approx([0.0, -1.0, 0.0], abs=1e-12)


def test_two_contacts_close_only_as_soft_fingers(tmp_path):
    path = tmp_path / "grasps.npy"
    np.save(path, np.array([graspnet_row()]))
    contacts = load_graspnet(path)[0].contacts(BOX)
    assert not gc.force_closure(contacts, friction=0.5).closed
    assert gc.force_closure(contacts, friction=0.5, torsion_m=0.005).closed


def test_a_scene_is_taken_back_to_the_object(tmp_path):
    pose = np.eye(4)
    pose[:3, :3] = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    pose[:3, 3] = [0.5, 0.2, 0.1]
    here, there = tmp_path / "here.npy", tmp_path / "there.npy"
    np.save(here, np.array([graspnet_row()]))
    np.save(there, np.array([graspnet_row(rotation=pose[:3, :3], at=pose[:3, 3])]))
    (one,), (two,) = load_graspnet(here), load_graspnet(there, object_pose=pose)
    for a, b in zip(one.contacts(BOX), two.contacts(BOX), strict=True):
        assert a.position == pytest.approx(b.position, abs=1e-12)


def acronym_pose():
    """The palm looks along minus z from above, with its fingers' closing line at the middle."""
    pose = np.diag([1.0, -1.0, -1.0, 1.0])
    pose[2, 3] = PANDA_END_M - 0.01
    return pose


def acronym_file(path, poses, labels):
    with h5py.File(path, "w") as file:
        file["grasps/transforms"] = poses
        file["grasps/qualities/flex/object_in_gripper"] = labels
        file["object/scale"] = 1.0
    return path


def test_acronyms_fingers_meet_the_cube_across_x(tmp_path):
    away = acronym_pose()
    away[0, 3] = 0.5
    path = acronym_file(tmp_path / "a.h5", [acronym_pose(), away], [1, 0])
    good, bad = load_acronym(path)
    assert (good.score, bad.score) == (1.0, 0.0)
    assert good.opening_m == pytest.approx(0.082)
    left, right = good.contacts(BOX)
    assert left.position == pytest.approx([-0.02, 0.0, 0.0], abs=1e-9)
    assert right.normal == pytest.approx([-1.0, 0.0, 0.0], abs=1e-12)
    assert bad.contacts(BOX) == ()


def test_acronyms_json_says_the_same(tmp_path):
    path = tmp_path / "a.json"
    found = {"transforms": [acronym_pose().tolist()], "quality_flex_object_in_gripper": [1]}
    path.write_text(json.dumps(found))
    other = acronym_file(tmp_path / "a.h5", [acronym_pose()], [1])
    assert load_acronym(path) == load_acronym(other)


def test_what_is_no_such_file_is_refused(tmp_path):
    table = tmp_path / "table.npy"
    np.save(table, np.zeros((3, 5)))
    with pytest.raises(InputError, match="17 numbers"):
        load_graspnet(table)
    broken = tmp_path / "broken.h5"
    broken.write_bytes(b"\x89HDF\r\n\x1a\nnothing")
    with pytest.raises(InputError, match=r"broken\.h5"):
        load_acronym(broken)
    with pytest.raises(InputError, match="a label for each"):
        load_acronym(acronym_file(tmp_path / "short.h5", [acronym_pose()] * 2, [1]))
    with pytest.raises(InputError, match="rotation"):
        GripperGrasp(np.diag([2.0, 1.0, 1.0, 1.0]), 0.08, 1.0)
    text = tmp_path / "a.json"
    text.write_text('{"transforms": []}')
    with pytest.raises(InputError, match="quality_flex"):
        load_acronym(text)


def test_a_gripper_that_is_narrower_than_the_object_meets_nothing():
    assert GripperGrasp(np.eye(4), 0.03, 1.0).contacts(BOX) == ()
