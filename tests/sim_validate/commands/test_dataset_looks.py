"""Commands that count what a dataset holds, and show some of its rows."""

import json
import re

import numpy as np
import pytest

import sim_validate
from sim_validate.cli.exit_codes import Exit
from sim_validate.datasets.describing.stats import stats_of
from sim_validate.datasets.open_dataset import select
from sim_validate.main import main
from sim_validate.reports.datasets.sample_page import drawn_rows
from tests.sim_validate.datasets.small import build_small

pytest.importorskip("pyarrow")


@pytest.fixture(scope="module")
def ds(tmp_path_factory):
    return build_small(tmp_path_factory.mktemp("looks") / "ds")


def test_stats_count_the_rows_and_their_values(ds, tmp_path, capsys):
    assert main(["dataset", "stats", str(ds), "--out", str(tmp_path / "page")]) == Exit.GOOD
    said = capsys.readouterr().out
    grasps = sim_validate.load_dataset(ds)["grasps"]
    assert f"{len(grasps['held'])} grasps" in said
    found = json.loads((tmp_path / "page" / "stats.json").read_text(encoding="utf-8"))
    labels, counts = np.unique(grasps["label"].astype(str), return_counts=True)
    assert found["counts"]["grasps.label"] == dict(zip(labels, counts.tolist(), strict=True))
    (spread,) = [each for each in found["spreads"] if each["column"] == "closure_margin"]
    known = grasps["closure_margin"][np.isfinite(grasps["closure_margin"])]
    assert spread["known"] == len(known) > 3
    assert spread["quarters"] == pytest.approx(np.quantile(known, [0, 0.25, 0.5, 0.75, 1]).tolist())
    assert spread["missing"] == len(grasps["closure_margin"]) - len(known)


def test_the_page_of_stats_has_charts_and_needs_no_network(ds, tmp_path):
    main(["dataset", "stats", str(ds), "--out", str(tmp_path / "page"), "-q"])
    text = (tmp_path / "page" / "index.html").read_text(encoding="utf-8")
    drawn = [each for each in stats_of(select(ds)).spreads if len(set(each.values.tolist())) > 1]
    assert text.count("<svg") >= len(drawn) > 5
    assert not re.findall(r"(?:src|href)=\"(?!data:|#)", text)


def test_stats_of_a_split_are_of_its_objects_only(ds, capsys):
    assert main(["dataset", "stats", str(ds), "--split", "test", "--json"]) == Exit.GOOD
    assert json.loads(capsys.readouterr().out)["rows"]["objects"] == 1


def test_a_sample_shows_rows_with_pictures_and_only_the_seed_chooses(ds, tmp_path):
    out = tmp_path / "rows"
    command = ["dataset", "sample", str(ds), "--count", "4", "--out", str(out), "-q"]
    assert main(command) == Exit.GOOD
    text = (out / "index.html").read_text(encoding="utf-8")
    rows = drawn_rows(select(ds), 4, 0)
    assert len(rows) == 4
    assert all(row["grasp_id"] in text for row in rows)
    assert text.count("<svg") >= 1
    assert not re.findall(r"(?:src|href)=\"(?!data:|#)", text)
    main(command)
    assert (out / "index.html").read_text(encoding="utf-8") == text
    ids = [{row["grasp_id"] for row in drawn_rows(select(ds), 4, seed)} for seed in range(5)]
    assert any(each != ids[0] for each in ids)


def test_every_grasp_of_a_planar_object_has_a_picture(ds, tmp_path):
    out = tmp_path / "rows"
    main(["dataset", "sample", str(ds), "--count", "1000", "--out", str(out), "-q"])
    text = (out / "index.html").read_text(encoding="utf-8")
    rows = list(select(ds).rows("grasps"))
    assert sum(row["label"] == "grasp" for row in rows) == 3
    shown = text.split("<article>")[1:]
    assert len(shown) == len(rows)
    for article in shown:
        if re.search(r"<th scope=\"row\">label</th><td>grasp</td>", article):
            assert "<svg" in article


@pytest.mark.parametrize("action", ["stats", "sample"])
def test_a_page_is_not_written_into_its_dataset(ds, capsys, action):
    out = str(ds / "page")
    assert main(["dataset", action, str(ds), "--out", out]) == Exit.INPUT
    assert "is in the dataset" in capsys.readouterr().err
