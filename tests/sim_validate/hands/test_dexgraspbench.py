"""DexGraspBench reads our records, we read its records, and nothing in a file is executed."""

import io
import json
import pickle

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.errors import InputError
from grasp_core.hands.hand_arrays import places
from grasp_core.hands.reach import stance_of
from sim_validate.hands.dexgraspbench import (
    ROOT_POSE,
    DexRecord,
    dex_record,
    hand_file,
    load_dex_record,
    pose_of,
    reach_of_record,
    write_dex_object,
    write_dex_record,
)
from tests.grasp_core.hands.gripping import FRICTION, reaches, scaled

SAME = 1e-9
HANDS = ("allegro", "leap")


def reached(hand, name="dodecahedron", radius=0.035):
    return [each for each in reaches(hand, name, radius) if each.reached]


def as_dexgraspbench_reads(path):
    """Its own line: numpy.load with trust, and the item of an array without dimensions."""
    return np.load(path, allow_pickle=True).item()


@pytest.mark.parametrize("hand", HANDS)
def test_a_round_trip_keeps_contacts(hand, tmp_path):
    body, model = scaled("dodecahedron", 0.035), gc.load_hand(hand)
    found = reached(hand)
    assert len(found) >= 2
    for number, reach in enumerate(found):
        record = dex_record(model, reach, "objects/dodecahedron")
        path = write_dex_record(record, tmp_path / f"{number}.npy")
        read = load_dex_record(path)
        assert read == record
        again = reach_of_record(read, model, body, FRICTION, name=reach.grasp)
        assert again.reached
        order = np.argsort(reach.fingers)
        for one, place in zip(again.contacts, order, strict=True):
            assert one.position == pytest.approx(reach.contacts[place].position, abs=SAME)
            assert one.normal == pytest.approx(reach.contacts[place].normal, abs=SAME)
        assert again.fingers.tolist() == np.sort(reach.fingers).tolist()
        assert again.palm_pose == pytest.approx(reach.palm_pose, abs=SAME)
        assert again.certificate.verify()


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


def test_a_record_away_from_the_object_touches_nothing_and_an_open_one_is_refuted():
    model, reach = gc.load_hand("allegro"), reached("allegro")[0]
    record = dex_record(model, reach, "o")
    shifted = [np.array(each) for each in (record.pregrasp, record.grasp, record.squeeze)]
    for each in shifted:
        each[2] += 0.5
    away = DexRecord("o", 1.0, record.object_pose, *shifted)
    found = reach_of_record(away, model, scaled("dodecahedron", 0.035), FRICTION)
    assert (found.reached, found.reason) == (False, "not found")
    slippery = reach_of_record(record, model, scaled("dodecahedron", 0.035), 1e-3)
    assert (slippery.reached, slippery.reason) == (False, "no closure")
    assert slippery.open_choices[0].verify()


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


FIELDS = {
    "obj_path": "assets/object", "obj_scale": np.float64(0.06),
    "obj_pose": np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]),
    "pregrasp_qpos": np.array([0, 0, 0, 1, 0, 0, 0, 0.1], np.float32),
    "grasp_qpos": np.array([0, 0, 0, 1, 0, 0, 0, 0.2], np.float32),
    "squeeze_qpos": np.array([0, 0, 0, 1, 0, 0, 0, 0.3], np.float32),
    "n_evo": 3, "scene": {"names": ["one", "two"], "nothing": None, "yes": True},
}  # fmt: skip


def saved(value, path, protocol=None):
    """A `.npy` file as numpy.save writes it, or with a pickle of another protocol."""
    held = io.BytesIO()
    np.lib.format.write_array_header_1_0(held, {"descr": "|O", "fortran_order": False, "shape": ()})
    array = np.array(value, dtype=object)
    path.write_bytes(held.getvalue() + pickle.dumps(array, protocol=protocol))
    return path


class Runs:
    """Unpickling this would call a function."""

    def __init__(self, called, *arguments):
        self.made = (called, arguments)

    def __reduce__(self):
        return self.made


@pytest.mark.parametrize("protocol", [2, 4])
@pytest.mark.parametrize(
    "harm",
    [Runs(exec, "raise SystemExit('executed')"), Runs(getattr, "a", "b"), Runs(bytes, 2**60),
     Runs(np.zeros, 2**60), np.ma.array([1.0]), np.array(["text"]), np.datetime64("now"),
     np.zeros(2, [("a", "O"), ("b", "f8")])],
    ids=["exec", "getattr", "bytes", "zeros", "masked", "text", "time", "structured"],
)  # fmt: skip
def test_a_file_that_names_anything_but_plain_arrays_is_refused(protocol, harm, tmp_path):
    path = saved(FIELDS | {"harm": harm}, tmp_path / "0.npy", protocol)
    with pytest.raises(InputError, match=r"which is not looked up|expected numbers"):
        load_dex_record(path)


def test_any_damage_is_refused_with_our_error(tmp_path):
    path = saved(FIELDS, tmp_path / "0.npy", 4)
    data = path.read_bytes()
    rng = np.random.default_rng(0)
    refused = 0
    for _ in range(400):
        damaged = bytearray(data)
        damaged[rng.integers(len(data))] = rng.integers(256)
        path.write_bytes(bytes(damaged[: rng.integers(1, len(data) + 1)]))
        try:
            load_dex_record(path)
        except InputError:
            refused += 1
    assert refused > 300


@pytest.mark.parametrize(
    ("value", "said"),
    [(np.array([FIELDS, FIELDS], object), "one grasp, got a list"), (np.zeros(3), "of numbers"),
     (np.array("text", object), "got a str")],
    ids=["several records", "numbers", "text"],
)  # fmt: skip
def test_files_of_another_kind_are_refused(value, said, tmp_path):
    np.save(tmp_path / "0.npy", value, allow_pickle=True)
    with pytest.raises(InputError, match=rf"0.npy: expected .*{said}"):
        load_dex_record(tmp_path / "0.npy")
    (tmp_path / "0.pkl").write_bytes(pickle.dumps(FIELDS))
    with pytest.raises(InputError, match=r"0.pkl: expected a .npy file"):
        load_dex_record(tmp_path / "0.pkl")


@pytest.mark.parametrize(
    ("change", "said"),
    [({"grasp_qpos": None}, "no grasp_qpos"), ({"obj_pose": np.zeros(7)}, "length 1"),
     ({"squeeze_qpos": np.ones(5)}, "squeeze"), ({"obj_scale": -1.0}, "obj_scale")],
    ids=lambda value: str(value)[:20],
)  # fmt: skip
def test_what_a_record_lacks_is_named(change, said, tmp_path):
    fields = {key: value for key, value in (FIELDS | change).items() if value is not None}
    with pytest.raises(InputError, match=said):
        load_dex_record(saved(fields, tmp_path / "0.npy"))
