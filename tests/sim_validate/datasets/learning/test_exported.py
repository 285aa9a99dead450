"""Datasets with all that learners may ask for can be exported, and their objects drawn in depth."""

import csv
import json

import numpy as np
import pytest

from scenes.drawing.clips import GraphicsError
from scenes.drawing.depth.cameras import Lens
from sim_validate.datasets.exports.depths import AskedDepths, write_depths
from sim_validate.datasets.exports.formats import export
from sim_validate.datasets.open_dataset import select
from sim_validate.main import main
from tests.scenes.drawing.depth.ray_depths import ray_depths
from tests.sim_validate.datasets.engines import silent
from tests.sim_validate.datasets.learned import BODIES, LEARNED, rows_of

ASKED = AskedDepths(views=3, seed=5, lens=Lens(24, 16))


def depths(dataset, out, asked):
    try:
        write_depths(out, select(dataset), asked, silent)
    except GraphicsError as error:
        pytest.skip(str(error))
    return json.loads((out / "depths.json").read_text())


def test_csv_has_a_column_for_each_number_of_long_cells(learned, tmp_path):
    export(learned, "csv", tmp_path / "csv", None, silent)
    with (tmp_path / "csv" / "objects.csv").open(newline="") as file:
        rows = {row["object_id"]: row for row in csv.DictReader(file)}
    for row in rows_of(learned, "objects"):
        last = LEARNED.learning.points - 1
        cells = [float(rows[row["object_id"]][f"cloud_points_m_{last}_{axis}"]) for axis in "xyz"]
        assert cells == row["cloud_points_m"][last]
    with (tmp_path / "csv" / "grasps.csv").open(newline="") as file:
        rows = {row["grasp_id"]: row for row in csv.DictReader(file)}
    for row in rows_of(learned, "grasps"):
        text = rows[row["grasp_id"]]["hand_joints_rad_15"]
        assert text == "" if not row["hand_reached"] else float(text) == row["hand_joints_rad"][15]


def test_each_object_has_depth_images_from_where_the_cameras_are_said_to_be(learned, tmp_path):
    index = depths(learned, tmp_path / "depths", ASKED)
    assert {each["object_id"] for each in index["objects"]} == set(BODIES)
    splits = {row["object_id"]: row["split"] for row in rows_of(learned, "objects")}
    for each in index["objects"]:
        assert each["path"] == f"{splits[each['object_id']]}/{each['object_id']}.npz"
        found = np.load(tmp_path / "depths" / each["path"])
        assert found["depth_m"].shape == (3, 16, 24)
        for depth, seen, pose in zip(
            found["depth_m"], found["on_object"], found["T_object_camera_m"], strict=True
        ):
            rays, near_edge = ray_depths(BODIES[each["object_id"]], pose, found["K"], (16, 24))
            both = seen & (rays > 0.0) & (near_edge > 1e-3)
            assert both.sum() > 30
            np.testing.assert_allclose(depth[both], rays[both], rtol=5e-6)


def test_objects_lie_on_the_table_as_the_table_of_resting_poses_says(learned, tmp_path):
    asked = AskedDepths(views=4, on_table=True, seed=5, lens=Lens(24, 16))
    index = depths(learned, tmp_path / "depths", asked)
    rests = {(row["object_id"], row["rest"]): row for row in rows_of(learned, "rests")}
    for each in index["objects"]:
        found = np.load(tmp_path / "depths" / each["path"])
        for number, pose in zip(found["rest"], found["T_object_table_m"], strict=True):
            stated = np.array(rests[each["object_id"], number]["T_table_object_m"])
            assert stated @ pose == pytest.approx(np.eye(4), abs=1e-9)
        ups = found["T_object_table_m"][:, :3, 2]
        heights = found["T_object_camera_m"][:, :3, 3] - found["T_object_table_m"][:, :3, 3]
        assert (np.einsum("ij,ij->i", heights, ups) > 0.0).all()
        assert (found["depth_m"] > 0.0).mean() > found["on_object"].mean() + 0.2


def test_the_seed_and_the_object_decide_where_cameras_are(learned, tmp_path):
    for name, seed in (("one", 5), ("again", 5), ("other", 6)):
        depths(learned, tmp_path / name, AskedDepths(views=3, seed=seed, lens=Lens(24, 16)))
    paths = sorted(path.relative_to(tmp_path / "one") for path in (tmp_path / "one").rglob("*.npz"))
    assert len(paths) == len(BODIES)
    for path in paths:
        poses = [
            np.load(tmp_path / name / path)["T_object_camera_m"]
            for name in ("one", "again", "other")
        ]
        assert np.array_equal(poses[0], poses[1])
        assert not np.allclose(poses[0], poses[2])


def test_the_command_draws_and_refuses_the_dataset_s_own_folder(learned, tmp_path, capsys):
    words = ["dataset", "depth", str(learned), "--views", "1", "--width", "8", "--height", "8"]
    assert main([*words, "--out", str(learned / "depths")]) == 4
    assert "is in the dataset" in capsys.readouterr().err
    depths(learned, tmp_path / "tried", ASKED)  # skips where nothing can be drawn
    assert main([*words, "--out", str(tmp_path / "new")]) == 0
    assert "2 objects with 1 image each" in capsys.readouterr().out


def test_a_build_writes_the_page_of_its_statistics(learned, tmp_path, capsys):
    """The dataset is finished already, so that the build only says so and counts its rows."""
    config = tmp_path / "learned.toml"
    config.write_text((learned / "config.toml").read_text())
    words = ["dataset", "build", str(config), "--out", str(learned)]
    assert main([*words, "--stats", str(learned / "stats")]) == 4
    assert "is in the dataset" in capsys.readouterr().err
    assert main([*words, "--stats", str(tmp_path / "stats")]) == 0
    assert "index.html in a browser" in capsys.readouterr().out
    counts = json.loads((tmp_path / "stats" / "stats.json").read_text())
    assert counts["rows"]["grasps"] == len(rows_of(learned, "grasps"))
    page = (tmp_path / "stats" / "index.html").read_text()
    assert "survival by kind" in page
    assert all(f">{outcome}</text>" in page for outcome in ("survived", "lost", "not known"))
