"""Isaac grasp files of a dataset, read by their published format, are compared with its tables."""

import re
import shutil

import numpy as np
import pytest
from scipy.optimize import nnls

import grasp_core as gc
import sim_validate as sv
from grasp_core.files.records import record_of
from sim_validate.commands.exit_codes import Exit
from sim_validate.datasets.build import build
from sim_validate.datasets.config import DatasetConfig, DatasetHand, Learning
from sim_validate.datasets.isaac import export
from sim_validate.datasets.open_dataset import select
from sim_validate.main import main
from tests.isaac_files import last_link, read_isaac
from tests.sim_validate.datasets.engines import Here, contents, silent
from tests.sim_validate.datasets.forging import first, forged

pytest.importorskip("pyarrow")
pytest.importorskip("yaml")
TOUCHING = 1e-6
"""Farthest that a fingertip may be from its contact [m]; poses from a search are nearer by far."""


@pytest.fixture(scope="module")
def handed(tmp_path_factory):
    """Poses of LEAP in grasps of three objects in two splits; in one it cannot open."""
    config = DatasetConfig(
        objects=("wedge", "l-bracket", "prism"), families=("concurrent",), limit=2, seed=6,
        learning=Learning(synthetic=1, friction_above=1), hand=DatasetHand(hand="leap"),
    )  # fmt: skip
    folder = tmp_path_factory.mktemp("handed") / "ds"
    assert build(config, folder, Here(), silent).manifest.quarantined == 0
    return folder


@pytest.fixture
def copy(handed, tmp_path):
    return shutil.copytree(handed, tmp_path / "copy")


def wanted(dataset):
    """The rows that have a pose with open fingers and are planned grasps, by their names."""
    grasps = sv.load_dataset(dataset)["grasps"]
    there = (grasps["label"] == "grasp") & np.isfinite(grasps["hand_open_joints_rad"]).all(axis=1)
    rows = {
        grasps["grasp_id"][i]: {name: grasps[name][i] for name in grasps}
        for i in np.flatnonzero(there)
    }
    assert len(rows) >= 2
    return rows


def from_hull(corners, point):
    """Distance of a point from the hull of corners, whose shares are found to add up to one."""
    heavy = 1e3
    rows = np.vstack([(corners - point).T, np.full(len(corners), heavy)])
    shares, _ = nnls(rows, np.array([0.0, 0.0, 0.0, heavy]))
    return np.linalg.norm(shares @ (corners - point)) / shares.sum()


def test_the_hand_touches_where_the_tables_say(handed, tmp_path):
    export(handed, tmp_path / "out", None, silent)
    hand, rows = record_of(gc.load_hand("leap")), wanted(handed)
    joints = [link["joint"] for finger in hand["fingers"] for link in finger["links"]]
    for path in (tmp_path / "out").iterdir():
        of, palm, grasps = read_isaac(path)
        assert re.fullmatch(rf"[0-9a-f]{{16}}-{of}\.yaml", path.name)
        assert palm == "palm"
        for name, grasp in grasps.items():
            row = rows.pop(name)
            assert row["object_id"].startswith(path.name[:16])
            assert grasp.confidence == 0.5  # the hand was not simulated
            assert [*grasp.joints] == [joint["name"] for joint in joints]
            assert [*grasp.joints.values()] == row["hand_joints_rad"].tolist()
            assert [*grasp.open_joints.values()] == row["hand_open_joints_rad"].tolist()
            np.testing.assert_allclose(grasp.pose, row["T_object_palm_m"], rtol=0.0, atol=1e-14)
            for joint in joints:
                for angles in (grasp.joints, grasp.open_joints):
                    assert joint["lowest_rad"] <= angles[joint["name"]] <= joint["highest_rad"]
            for finger, point in zip(row["hand_fingers"], row["hand_points_m"], strict=True):
                tip, link = hand["fingers"][finger]["tip"], last_link(hand, finger, grasp)
                corners = np.array(tip["corners_m"]) @ link[:3, :3].T + link[:3, 3]
                apart = from_hull(corners, point) - tip["rounding_m"]
                assert apart == pytest.approx(0.0, abs=TOUCHING)
    assert not rows


def test_the_same_bytes_come_again_and_splits_add_up(handed, tmp_path):
    whole = export(handed, tmp_path / "one", None, silent)
    assert whole["grasps"] == len(wanted(handed))
    assert whole["objects"] == len(contents(tmp_path / "one"))
    assert export(handed, tmp_path / "again", None, silent) == whole
    assert contents(tmp_path / "one") == contents(tmp_path / "again")
    parts = [
        export(handed, tmp_path / split, split, silent) for split in ("train", "validation", "test")
    ]
    assert {name: sum(part[name] for part in parts) for name in whole} == whole
    assert sum(part["grasps"] > 0 for part in parts) == 2


def test_grasps_that_slipped_or_never_open_are_told_apart(copy, tmp_path):
    before = export(copy, tmp_path / "before", None, silent)
    assert before["never_opens"] >= 1
    forged(copy, "grasps", first(
        lambda row: row["label"] == "grasp" and row["hand_open_joints_rad"],
        hand_held=False,
    ))  # fmt: skip
    export(copy, tmp_path / "slipped", None, silent)
    said = [
        grasp.confidence
        for path in (tmp_path / "slipped").iterdir()
        for grasp in read_isaac(path)[2].values()
    ]
    assert said.count(0.0) == 1
    forged(copy, "grasps", lambda rows: [row.update(hand_open_joints_rad=None) for row in rows])
    after = export(copy, tmp_path / "after", None, silent)
    assert after["never_opens"] > before["never_opens"]
    assert after["grasps"] + after["never_opens"] == before["grasps"] + before["never_opens"]


@pytest.mark.parametrize("text", ["../../etc/passwd", "x" * 400, 'a: [b]\n"c": !!python/object'])
def test_names_of_objects_are_harmless_in_names_of_files_and_in_yaml(copy, tmp_path, text):
    for _ in range(3):  # an object each time
        forged(copy, "objects", first(lambda row: row["source_name"] != text, source_name=text))
    out = tmp_path / "deep" / "out"
    export(copy, out, None, silent)
    paths = list(out.iterdir())
    assert len(paths) >= 1
    assert all(re.fullmatch(r"[0-9a-f]{16}-[\w.-]{1,140}\.yaml", path.name) for path in paths)
    assert {read_isaac(path)[0] for path in paths} == {text}


def test_datasets_without_a_hand_and_folders_in_use_are_refused(
    handed, small_dataset, tmp_path, capsys
):
    words = ["dataset", "export", str(handed), "--out", str(tmp_path)]
    (tmp_path / "thesis.tex").write_text("all my work")
    assert main(words) == Exit.INPUT
    assert "not an empty folder" in capsys.readouterr().err
    assert main([*words[:-1], str(handed / "exports")]) == Exit.INPUT
    assert "--out must be outside of the dataset" in capsys.readouterr().err
    assert main(["dataset", "export", str(small_dataset), "--out", str(tmp_path / "x")]) == (
        Exit.INPUT
    )
    assert "the dataset must have poses of one, got none" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]
    assert select(small_dataset).hand is None
    assert select(handed).hand.name == "leap"


def test_the_command_says_what_it_wrote(handed, tmp_path, answer):
    found = answer("dataset", "export", handed, "--out", tmp_path / "out")
    assert found == {
        "dataset": str(handed), "split": None, "out": str(tmp_path / "out"),
        "objects": len(contents(tmp_path / "out")), "grasps": len(wanted(handed)),
        "never_opens": found["never_opens"],
    }  # fmt: skip
