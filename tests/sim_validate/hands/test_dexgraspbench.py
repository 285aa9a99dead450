"""DexGraspBench reads our records, and we read them as it does."""

import json

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.errors import InputError
from grasp_core.hands.hand_arrays import places
from grasp_core.hands.reach import stance_of
from sim_validate.hands.dexgraspbench import (
    ROOT_POSE,
    dex_record,
    hand_file,
    pose_of,
    write_dex_object,
    write_dex_record,
)
from sim_validate.judge.formats.reading import read_records
from tests.grasp_core.hands.gripping import reaches, scaled

SAME = 1e-9
HANDS = ("allegro", "leap")


def reached(hand, name="dodecahedron", radius=0.035):
    return [each for each in reaches(hand, name, radius) if each.reached]


def as_dexgraspbench_reads(path):
    """Its own line: numpy.load with trust, and the item of an array without dimensions."""
    return np.load(path, allow_pickle=True).item()


@pytest.mark.parametrize("hand", HANDS)
def test_a_round_trip_keeps_every_number(hand, tmp_path):
    model = gc.load_hand(hand)
    found = reached(hand)
    assert len(found) >= 2
    for number, reach in enumerate(found):
        record = dex_record(model, reach, "objects/dodecahedron")
        (read,) = read_records([write_dex_record(record, tmp_path / f"{number}.npy")])
        assert (read.object, read.scale) == ("objects/dodecahedron", 1.0)
        for name in ("pregrasp", "grasp", "squeeze"):
            written, again = getattr(record, name), getattr(read, name)
            assert again.root == pytest.approx(pose_of(written), abs=SAME)
            assert again.joints.tolist() == written[ROOT_POSE:].tolist()


def test_dexgraspbench_finds_what_it_looks_for(tmp_path):
    model, reach = gc.load_hand("allegro"), reached("allegro")[0]
    record = dex_record(model, reach, str(tmp_path / "object"))
    data = as_dexgraspbench_reads(write_dex_record(record, tmp_path / "0.npy"))
    keys = ("obj_path", "obj_scale", "obj_pose", "pregrasp_qpos", "grasp_qpos", "squeeze_qpos")
    assert tuple(data) == keys
    assert data["grasp_qpos"].shape == (7 + 16,)
    assert np.concatenate([data["pregrasp_qpos"], data["obj_pose"]]).shape == (23 + 7,)
    assert np.linalg.norm(data["grasp_qpos"][3:7]) == pytest.approx(1.0)
    assert data["obj_scale"] ** 3 == 1.0


def test_the_squeeze_turns_joints_by_the_torque_of_the_forces_over_the_stiffness():
    """Twice the stiffness gives half the turn, and twice the push twice the turn."""
    model, reach = gc.load_hand("allegro"), reached("allegro")[0]
    usual = dex_record(model, reach, "o")
    stiff = dex_record(model, reach, "o", servo_n_m_per_rad=10.0)
    strong = dex_record(model, reach, "o", push_n=10.0)
    turns = [each.squeeze[ROOT_POSE:] - each.grasp[ROOT_POSE:] for each in (usual, stiff, strong)]
    assert np.abs(turns[0]).max() > 0.01
    assert turns[1] == pytest.approx(0.5 * turns[0], abs=1e-9)
    assert turns[2] == pytest.approx(2.0 * turns[0], abs=1e-9)
    levers = gc.hand_motors(model.with_torque_limits(1.0, "a test"), reach).levers
    forces = reach.certificate.forces
    normals = np.array([contact.normal for contact in reach.contacts])
    largest = np.einsum("ki,ki->k", forces, normals).max()
    assert turns[0] == pytest.approx(levers @ forces.ravel() / largest * 5.0 / 5.0, abs=1e-9)


@pytest.mark.parametrize("hand", HANDS)
@pytest.mark.parametrize("gap", [0.002, 0.005])
def test_fingertips_of_a_record_meet_the_object_at_one_moment(hand, gap):
    """Halfway in they are half the gap away, along each normal, but for the bend of their ways."""
    model = gc.load_hand(hand)
    (reach, *_) = [each for each in reached(hand) if each.pregrasp is not None]
    record = dex_record(model, reach, "o", gap_m=gap)
    palm = pose_of(record.grasp) @ hand_file(model).root
    ways = np.linspace(record.pregrasp, record.grasp, 3)[:, ROOT_POSE:]
    tips = places(stance_of(model, reach).hand, ways, palm).tips  # balls in place of blocks
    for contact, finger in zip(reach.contacts, reach.fingers, strict=True):
        away = (tips[2, finger] - tips[:2, finger]) @ contact.normal
        assert away == pytest.approx([gap, 0.5 * gap], abs=0.1 * gap)
    whole = dex_record(model, reach, "o", gap_m=None)
    assert whole.pregrasp[ROOT_POSE:] == pytest.approx(reach.pregrasp)


def test_the_object_is_one_convex_piece_with_the_mass_dexgraspbench_computes(tmp_path):
    body = scaled("dodecahedron", 0.035)
    folder = write_dex_object(body, tmp_path / "object")
    facts = json.loads((folder / "info" / "simplified.json").read_text())
    # base.py: mass over density and the cube of the scale, times density and scale of the grasp
    coefficient = facts["mass"] / (facts["density"] * facts["scale"] ** 3)
    assert coefficient == pytest.approx(body.volume)
    (piece,) = (folder / "urdf" / "meshes").iterdir()
    again = gc.load_polyhedron(piece, unit="m")
    assert again.volume == pytest.approx(body.volume, rel=1e-12)
    with pytest.raises(InputError, match="convex"):
        write_dex_object(scaled("l-bracket", 0.04), tmp_path / "other")
