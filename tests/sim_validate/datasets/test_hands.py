"""Datasets with a hand from a file: what its columns say, what is kept of it, and forged cells."""

import json
import math
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow.parquet
import pytest

import grasp_core as gc
import sim_validate as sv
from grasp_core.errors import UnfaithfulError
from grasp_core.execution.best_squeeze import searched
from grasp_core.execution.loads import any_direction
from grasp_core.hands.hand_arrays import places
from grasp_core.processes import local_processes
from scenes.hand_files.building import hand_from_file
from sim_validate.datasets import hand_work
from sim_validate.datasets.build import build
from sim_validate.datasets.config import DatasetConfig, DatasetHand, config_from_toml, settings_text
from sim_validate.datasets.hand_columns import HandCells
from sim_validate.datasets.hand_files import HandFiles, kept_fault
from sim_validate.datasets.layout import HAND_FOLDER, HAND_RECORD
from sim_validate.datasets.open_dataset import select
from sim_validate.datasets.verify import verify
from sim_validate.datasets.work_units import units_of
from sim_validate.execution.verdict import ExecutedGrasp
from sim_validate.hands.execute import HandHolder, hand_execution_settings
from sim_validate.hands.reaches import ReachedGrasp
from tests.patience import HANGING_S
from tests.sim_validate.datasets.configs import BODIES, HANDED, rows_of, with_gripper
from tests.sim_validate.datasets.engines import Here, contents, silent
from tests.sim_validate.datasets.forging import first, forged, relisted
from tests.sim_validate.hands.executing import stood
from tests.three_fingers import THREE_TIPS, three_fingers_file

pytest.importorskip("pyarrow")
JOINTS = [f"{finger}_{way}" for finger in ("thumb", "left", "right")
          for way in ("spread", "bend", "curl")]  # fmt: skip


class KilledError(BaseException):
    """Stands for the end of the process."""


@pytest.fixture
def copied(handed, tmp_path):
    return shutil.copytree(handed, tmp_path / "copy")


@pytest.fixture(scope="module")
def reached(handed):
    found = [row for row in rows_of(handed, "grasps") if row["hand_reached"]]
    assert {row["label"] for row in found} == {"grasp", "varied"}
    return found


def used(row):
    return [place for place, finger in enumerate(row["hand_fingers"]) if finger is not None]


def test_three_fingers_stand_at_three_of_four_contacts(reached, handed):
    """Each fingertip, the end of a capsule, is as far from its contact as it is thick."""
    hand = sv.load_dataset_hand(handed)
    assert any(used(row) != [0, 1, 2] for row in reached)
    for row in reached:
        fingers = [row["hand_fingers"][place] for place in used(row)]
        assert sorted(fingers) == [0, 1, 2]
        points, normals = (
            np.array([row[name][place] for place in used(row)])
            for name in ("hand_points_m", "hand_normals")
        )
        (unused,) = {0, 1, 2, 3} - {*used(row)}
        assert row["hand_points_m"][unused] == row["hand_normals"][unused] == [None] * 3
        assert gc.force_closure(points, normals, row["friction"]).closed
        found = places(hand, row["hand_joints_rad"], np.array(row["T_object_palm_m"]))
        for finger, point, normal in zip(fingers, points, normals, strict=True):
            tip, end = hand.fingers[finger].tip, hand.chains[finger][-1]
            middle = found.link_positions[0, end] + found.link_rotations[0, end] @ tip.center
            assert middle == pytest.approx(point - tip.radius * normal, abs=1e-5)


def test_motors_and_squeeze_are_those_of_the_pose(reached, handed):
    """The squeeze is the one that is found again from the row's own pose and contacts."""
    hand = sv.load_dataset_hand(handed)
    rows = [row for row in reached if row["hand_executed"]]
    assert rows
    for row in rows:
        body, places_used = BODIES[row["object_id"]], used(row)
        points, normals = (
            np.array([row[name][place] for place in places_used])
            for name in ("hand_points_m", "hand_normals")
        )
        proof = gc.force_closure(points, normals, row["friction"])
        fingers = np.array([row["hand_fingers"][place] for place in places_used])
        pose = gc.HandReach(
            hand.name, "it", "", "", 1, 0.0, fingers, np.array(row["hand_joints_rad"]),
            np.array(row["T_object_palm_m"]), proof, used=np.array(places_used),
        )  # fmt: skip
        settings = hand_execution_settings(0.02)
        holder = HandHolder(body, hand, pose, row["friction"])
        start, motors = holder.loose(settings)
        best = searched(start, any_direction(0.02), settings.push_n, motors)
        squeeze = np.array([row["hand_squeeze_n"][place] for place in places_used])
        assert squeeze == pytest.approx(best.grip.squeeze, rel=1e-6, abs=1e-6)
        assert row["hand_load_multiple"] == pytest.approx(best.scale, rel=1e-6)
        levers = motors.levers @ squeeze.ravel()
        assert row["hand_motor_share"] == pytest.approx(np.abs(levers / motors.limits).max())
        assert 0.0 < row["hand_motor_share"] <= 1.0
        assert row["hand_mass_kg"] == 0.02
        payload = gc.hand_payload(hand, body, pose, row["friction"], max_push_n=100.0)
        assert payload.lower * 0.998 <= row["hand_payload_kg"] <= payload.upper


def test_trials_are_simulated_for_planned_grasps_only(reached, handed):
    for row in reached:
        planned = row["label"] == "grasp"
        assert (row["hand_held"] is not None) == (row["hand_executed"] is not None) == planned
        assert row["hand_note"] == ""
        if planned:
            assert row["hand_held"]
            assert row["hand_controls"] == row["hand_controls_let_go"] >= 3
            assert row["hand_mismatches"] == row["hand_execution_mismatches"] == 0
            assert row["hand_weakest_n"] > 0.0
            assert row["hand_survived"] or row["hand_predicted_loss"] is not None
    others = [row for row in rows_of(handed, "grasps") if not row["force_closed"]]
    assert {row["hand_reached"] for row in others} == {None}


def test_the_loader_gives_arrays_and_the_hand_with_its_joints(handed):
    columns = sv.load_dataset(handed)["grasps"]
    count, found = len(columns["grasp_id"]), columns["hand_reached"] == True  # noqa: E712
    assert columns["hand_joints_rad"].shape == (count, len(JOINTS))
    assert columns["T_object_palm_m"].shape == (count, 4, 4)
    assert columns["hand_fingers"].dtype == np.int64
    assert (np.sort(columns["hand_fingers"][found], axis=1) == [-1, 0, 1, 2]).all()
    assert np.isnan(columns["hand_points_m"][found]).any(axis=(1, 2)).all()
    hand = sv.load_dataset_hand(handed)
    assert [joint.name for joint in hand.joints] == JOINTS
    (path,) = handed.glob("data/grasps/*.parquet")
    schema = pyarrow.parquet.read_schema(path)
    for name in ("hand_joints_rad", "hand_open_joints_rad"):
        assert json.loads(schema.field(name).metadata[b"names"]) == JOINTS
    assert b"names" not in schema.field("hand_squeeze_n").metadata


def test_a_dataset_without_a_hand_has_none(small_dataset):
    assert sv.load_dataset_hand(small_dataset) is None
    assert not (small_dataset / HAND_FOLDER).exists()


def test_the_hand_is_kept_as_its_file_and_as_it_was_read(handed, gripping):
    (folder,) = (handed / HAND_FOLDER).iterdir()
    names = {path.name for path in folder.iterdir()}
    assert names == {"three_fingers.xml", "pad.stl", HAND_RECORD}
    listed = {each.path for each in select(handed).manifest.files}
    assert {f"{HAND_FOLDER}/{folder.name}/{name}" for name in names} <= listed
    again = hand_from_file(folder / "three_fingers.xml", THREE_TIPS)
    assert again == sv.load_dataset_hand(handed) == hand_from_file(
        gripping.hand.hand, THREE_TIPS
    )  # fmt: skip


def test_the_card_says_what_the_hand_is(handed):
    card = (handed / "README.md").read_text()
    assert "Poses of the hand three\\_fingers are looked for" in card
    assert "with the object's mass of 0.02 kg" in card
    lines = [f"| {name.replace('_', chr(92) + '_')} | " for name in JOINTS]
    assert [card.index(line) for line in lines] == sorted(card.index(line) for line in lines)
    assert "There is no hand" not in card


def test_a_coupled_hand_is_told_in_the_card(tmp_path):
    path = Path(three_fingers_file(tmp_path))
    rule = '<equality><joint joint1="left_curl" joint2="left_bend"/></equality></mujoco>'
    path.write_text(path.read_text().replace("</mujoco>", rule))
    hand = DatasetHand(hand=str(path), fingertips=THREE_TIPS)
    config = replace(HANDED, objects=("tetrahedron",), hand=hand, learning=None)
    assert build(config, tmp_path / "ds", Here(), silent).manifest.quarantined == 0
    assert "left\\_curl = 1 left\\_bend" in (tmp_path / "ds" / "README.md").read_text()
    assert verify(tmp_path / "ds", 1.0) == []

    def change(rows):
        row = next(row for row in rows if row["hand_reached"])
        row["hand_joints_rad"][JOINTS.index("left_curl") - 1] += 1e-3

    forged(tmp_path / "ds", "grasps", change)
    assert any("do not follow the joints" in fault for fault in verify(tmp_path / "ds"))


@pytest.mark.parametrize(
    ("cells", "message"),
    [
        ({"hand_joints_rad": [9.0] * 9}, "not within the ranges of the joints"),
        ({"hand_fingers": [0, 1, 2, 0]}, "exactly for the contacts with a finger"),
        ({"hand_points_m": [[0.0] * 3] * 4}, "exactly for the contacts with a finger"),
        ({"hand_payload_kg": 9.0}, "hand_payload_kg is 9, but from"),
        ({"hand_payload_kg": None}, "hand_payload_kg is None, but"),
        ({"hand_motor_share": 0.5}, "hand_motor_share is 0.5, but"),
        ({"hand_load_multiple": 99.0}, "hand_load_multiple is 99, but the squeeze is not proved"),
        ({"hand_load_multiple": None}, "hand_load_multiple is missing"),
        ({"hand_mass_kg": 0.01}, "hand_mass_kg is 0.01, but 0.02 by config.toml"),
        ({"hand_squeeze_n": None}, "hand_squeeze_n must be there exactly where hand_executed"),
        ({"hand_controls_let_go": 9}, "hand_controls_let_go is 9 of"),
        ({"hand_held": None}, "hand_held is missing, and hand_note has no reason"),
    ],
)
def test_forged_cells_are_named(copied, cells, message):
    forged(copied, "grasps", first(lambda row: row["hand_executed"], **cells))
    assert any(message in fault for fault in verify(copied))


def test_a_stronger_squeeze_is_beyond_the_motors(copied):
    def change(rows):
        row = next(row for row in rows if row["hand_executed"])
        row["hand_squeeze_n"] = [
            [None if x is None else 2.0 * x for x in force] for force in row["hand_squeeze_n"]
        ]
        row["hand_motor_share"] *= 2.0

    forged(copied, "grasps", change)
    assert any("the squeeze is not proved to carry" in fault for fault in verify(copied))


def test_trials_of_a_varied_grasp_were_not_asked_for(copied):
    where = first(lambda row: row["hand_reached"] and row["label"] == "varied", hand_held=True)
    forged(copied, "grasps", where)
    assert any("hand_held is there, but config.toml" in fault for fault in verify(copied))


@pytest.mark.slow
def test_a_whole_dataset_has_no_fault_and_comes_out_the_same_again(handed):
    assert verify(handed, 1.0) == []


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("three_fingers.xml", b"0 0 0.06", b"0 0 0.07"),
        (HAND_RECORD, b"three_fingers.xml;", b"another.xml;"),
    ],
)
def test_another_hand_in_the_place_of_the_kept_one_is_named(copied, name, old, new):
    """A forger may adapt the manifest, and the name of the folder, too."""
    (folder,) = (copied / HAND_FOLDER).iterdir()
    path, asked = folder / name, config_from_toml(copied / "config.toml").hand
    assert kept_fault(asked, folder) == ""
    text = path.read_bytes()
    assert old in text
    path.write_bytes(text.replace(old, new))
    with pytest.raises(gc.InputError, match="the file differs from what was written"):
        sv.load_dataset_hand(copied)
    relisted(copied, path)
    assert any("the files are others than the name" in fault for fault in verify(copied))
    moved = folder.rename(folder.parent / HandFiles.kept(folder).sha256)
    assert kept_fault(asked, moved).endswith("hand.json is another hand")


def test_the_same_hand_elsewhere_gives_the_same_bytes_on_two_processes(handed, tmp_path):
    """All but where the file was, as it was given: the settings and the card tell that."""
    config = with_gripper(tmp_path)
    with local_processes(2) as engine:
        build(config, tmp_path / "ds", engine, silent, HANGING_S)
    telling = {"config.toml", "README.md", "manifest.json"}
    one, other = (contents(folder) for folder in (handed, tmp_path / "ds"))
    assert one.keys() == other.keys()
    tables = {name for name in one if name.startswith("data/")}
    assert tables
    assert all(one[name] == other[name] for name in one.keys() - telling - tables)
    before, after = (select(folder).manifest.units_sha256 for folder in (handed, tmp_path / "ds"))
    assert before == after
    for name in ("grasps", "trials"):
        assert rows_of(handed, name) == rows_of(tmp_path / "ds", name)


def test_a_killed_build_goes_on_without_the_file_of_its_hand(handed, gripping, tmp_path):
    own = with_gripper(tmp_path)

    def die(_):
        if len(engine.submitted) == 2:
            raise KilledError

    engine = Here(die)
    with pytest.raises(KilledError):
        build(own, tmp_path / "ds", engine, silent)
    Path(own.hand.hand).unlink()
    shutil.rmtree(tmp_path / "shapes")
    assert build(own, tmp_path / "ds", Here(), silent).made == 1
    assert build(own, tmp_path / "ds", Here(), silent).made == 0
    assert verify(tmp_path / "ds") == []
    assert rows_of(tmp_path / "ds", "grasps") == rows_of(handed, "grasps")
    assert sv.load_dataset_hand(tmp_path / "ds") == sv.load_dataset_hand(handed)
    assert Path(gripping.hand.hand).is_file()


def test_another_hand_makes_other_units_and_is_refused_in_a_finished_dataset(tmp_path):
    config = replace(with_gripper(tmp_path), objects=("tetrahedron",), learning=None)
    config = replace(config, hand=replace(config.hand, simulate=False, mass_kg=None))
    build(config, tmp_path / "ds", Here(), silent)
    path = Path(config.hand.hand)
    path.write_text(path.read_text().replace("0 0 0.04", "0 0 0.041"))
    with pytest.raises(gc.InputError, match="its meshes, contacts, hand or package versions have"):
        build(config, tmp_path / "ds", Here(), silent)
    one, other = (
        {unit.id for unit in units_of(config, tmp_path / name)} for name in ("first", "second")
    )
    assert not one & other
    assert one == {unit.id for unit in units_of(config, Path("elsewhere") / "first")}


def test_a_simulation_that_is_refused_leaves_the_pose(monkeypatch, gripping, tmp_path):
    plain = hand_work.reached_grasp

    def unfaithful(hand, body, grasp, friction, task):
        if task.simulate:
            raise UnfaithfulError("the simulator is not faithful here")
        return plain(hand, body, grasp, friction, task)

    monkeypatch.setattr(hand_work, "reached_grasp", unfaithful)
    config = replace(gripping, objects=("tetrahedron",), learning=None)
    build(config, tmp_path / "ds", Here(), silent)
    (row,) = [row for row in rows_of(tmp_path / "ds", "grasps") if row["hand_reached"]]
    assert row["hand_note"] == "the simulator is not faithful here"
    assert row["hand_held"] is row["hand_executed"] is row["hand_survived"] is None
    assert row["hand_payload_kg"] > 0.0
    assert verify(tmp_path / "ds") == []


def test_fingers_that_cannot_give_are_no_loss_of_the_object(tmp_path):
    """The thumb of the page has two joints."""
    path = three_fingers_file(tmp_path)
    hand = DatasetHand(hand=path, fingertips=THREE_TIPS, mass_kg=0.02)
    config = replace(HANDED, objects=("tetrahedron",), hand=hand, learning=None)
    build(config, tmp_path / "ds", Here(), silent)
    (row,) = [row for row in rows_of(tmp_path / "ds", "grasps") if row["hand_reached"]]
    assert (row["hand_executed"], row["hand_survived"]) == (False, None)
    assert "is stretched, or has fewer than three joints" in row["hand_note"]
    assert verify(tmp_path / "ds") == []


def test_a_hand_without_a_squeeze_loses_the_object():
    reach, hand = stood("allegro")
    refused = ExecutedGrasp(reach.grasp, "", "0", None, "no squeeze carries the weight")
    cells = HandCells.of(hand, ReachedGrasp(reach, "0", executed=refused))
    assert (cells.executed, cells.survived) == (False, False)
    assert cells.note == "no squeeze carries the weight"


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ({}, "hand.hand: missing; choose from allegro"),
        ({"mass_kg": 1.0}, "hand.hand: missing"),
        ({"hand": "leap", "fingertips": ["a"]}, "hand: fingertips: the built-in hand leap has its"),
        ({"hand": "leap", "mass_kg": 1.0, "density_kg_m3": 2.0}, "exclude each other"),
        ({"hand": "leap", "motors": 1}, "no setting is named 'motors'"),
    ],
)
def test_settings_that_do_not_fit_are_refused(table, said):
    with pytest.raises(gc.InputError) as raised:
        DatasetConfig.of_table({"objects": ["wedge"], "hand": table})
    assert said in str(raised.value)


def test_the_settings_of_a_hand_are_read_as_they_are_written(tmp_path):
    path = tmp_path / "config.toml"
    path.write_text(settings_text(HANDED))
    assert config_from_toml(path) == HANDED


def test_hands_that_cannot_be_had_end_a_build_before_it_begins(tmp_path):
    def refusal(**given):
        with pytest.raises(gc.InputError) as raised:
            build(replace(HANDED, hand=DatasetHand(**given)), tmp_path / "ds", Here(), silent)
        assert not (tmp_path / "ds" / "config.toml").exists()
        return str(raised.value)

    assert "built-in hands are allegro" in refusal(hand="nose")
    missing = refusal(hand="allegro", simulate=True)
    assert "simulate needs a torque limit for each joint" in missing
    assert "with torque_limit_n_m" in missing
    (tmp_path / "ds").mkdir()
    inside = three_fingers_file(tmp_path / "ds")
    assert "lies in the output folder" in refusal(hand=inside, fingertips=THREE_TIPS)
    assert math.isclose(DatasetHand(hand="leap", density_kg_m3=500).density_kg_m3, 500.0)
