"""The command `plan --best`."""

import json
from typing import get_args, get_type_hints

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.optimizing.support_cuts import read_proof
from grasp_core.quality.measures import MeasureName
from sim_validate.kit.command_flags import Plan
from sim_validate.main import main
from sim_validate.planning.best import Best

ASKED = ["plan", "tetrahedron", "--limit", "2", "--families", "concurrent", "--best"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("best")
    assert main([*ASKED, "--gap", "0.2", "--out", str(folder), "-q"]) == 0
    return folder


def test_the_best_grasp_comes_first_and_its_proof_holds(folder):
    text = (folder / "best.json").read_text()
    assert Best.of_text(text).text() == text
    best = json.loads(text)
    grasps = gc.load_grasps(folder / "grasps.json")
    proof = read_proof(folder / best["proof"])
    assert proof.verify()
    assert proof.bound == best["bound"]
    assert grasps[0].id == best["grasp"]["id"]
    assert np.allclose(grasps[0].positions, best["grasp"]["positions_m"], rtol=0.0, atol=1e-12)
    assert best["quality"][0] <= best["bound"]
    assert best["gap"] <= 0.2
    assert best["ended"] == "gap"
    assert [now["bound"] for now in best["history"]][-1] == best["bound"]


def test_planned_grasps_are_compared_with_the_bound(folder):
    best = json.loads((folder / "best.json").read_text())
    assert len(best["planned"]) == len(gc.load_grasps(folder / "grasps.json")) - 1 > 0
    for grasp in best["planned"]:
        assert grasp["share_of_bound"] == grasp["quality"][0] / best["bound"]


def test_a_time_limit_ends_with_the_gap_reached(capsys):
    assert main([*ASKED, "--gap", "0.001", "--time-limit-s", "0.1"]) == 6
    assert "the time limit is reached" in capsys.readouterr().out


def test_new_results_replace_old_ones(tmp_path):
    (tmp_path / "best.json").write_text("{}")
    assert main(["plan", "tetrahedron", "--limit", "1", "--out", str(tmp_path), "-q"]) == 0
    assert not (tmp_path / "best.json").exists()


def test_the_weight_and_a_task_can_be_held_best(tmp_path, capsys):
    task = tmp_path / "lift.json"
    task.write_text(
        '{"wrenches": [{"name": "lift", "force_n": [0, 0, -3]}, '
        '{"name": "turn", "force_n": [0, 0, -3], "torque_n_m": [0.02, 0, 0]}]}'
    )
    for flags in (["weight"], ["task", "--wrenches", str(task)]):
        out = tmp_path / flags[0]
        assert main([*ASKED, "--gap", "0.4", "--measure", *flags, "--out", str(out)]) == 0
        best = json.loads((out / "best.json").read_text())
        proof = read_proof(out / best["proof"])
        assert proof.verify()
        assert best["measure"] == proof.measure.name == flags[0]
        assert proof.bound == best["bound"] >= best["quality"][0]
        assert {now["bound"] for now in best["history"]} >= {proof.bound}
        # planned contacts keep no distance from edges, and need not be below the bound
        assert all(each["quality"][0] <= each["quality"][1] for each in best["planned"])
        assert best["planned"]
        assert gc.load_grasps(out / "grasps.json")[0].id == best["grasp"]["id"]
    loads = [[0, 0, -3, 0, 0, 0], [0, 0, -3, 0.02, 0, 0]]
    assert np.allclose(best["wrenches"], loads, rtol=0.0, atol=1e-12)
    assert "multiple" in capsys.readouterr().out


@pytest.mark.parametrize("flags", [["--measure", "task"], ["--wrenches", "task.json"]])
def test_flags_of_measures_that_do_not_fit_are_usage_errors(flags):
    assert main([*ASKED, *flags]) == 2


def test_the_flag_knows_every_measure():
    assert get_args(get_type_hints(Plan)["measure"]) == get_args(MeasureName)
