"""Better grasps: the commands `plan --optimize` and `plan --best`."""

import json

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.optimizing.support_cuts import read_proof
from grasp_core.records.grasps_json import grasps_from_json
from sim_validate.commands.exit_codes import Exit
from sim_validate.main import main
from sim_validate.planning.best import Best
from tests.sim_validate.interrupts import interrupt_once

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


def test_planned_grasps_are_written_where_no_best_one_is_found(tmp_path, monkeypatch, capsys):
    def none(*_, **__):
        raise gc.InputError("no contacts in force closure")

    monkeypatch.setattr("sim_validate.planning.best.best_until", none)
    assert main([*ASKED, "--out", str(tmp_path)]) == Exit.INPUT
    assert "no contacts in force closure" in capsys.readouterr().err
    assert len(gc.load_grasps(tmp_path / "grasps.json")) == 1


def test_an_object_that_no_best_grasp_can_be_searched_on_is_refused_before_it_is_planned(
    monkeypatch, capsys
):
    monkeypatch.setattr("grasp_core.optimizing.contact_places.MOST_PIECES", 3)
    monkeypatch.setattr("sim_validate.planning.plan.search_plan", None)
    assert main(ASKED) == Exit.INPUT
    assert "1 to 3 convex pieces" in capsys.readouterr().err


def test_an_interrupt_of_planning_ends_the_search_for_the_best_too(tmp_path, monkeypatch):
    interrupt_once(monkeypatch)
    assert main([*ASKED, "--out", str(tmp_path)]) == Exit.INTERRUPTED
    assert gc.load_grasps(tmp_path / "grasps.json").ended == "interrupt"
    assert not (tmp_path / "best.json").exists()


def test_a_task_can_be_held_best(tmp_path, capsys):
    task = tmp_path / "lift.json"
    task.write_text(
        '{"wrenches": [{"name": "lift", "force_n": [0, 0, -3]}, '
        '{"name": "turn", "force_n": [0, 0, -3], "torque_n_m": [0.02, 0, 0]}]}'
    )
    flags = ["--gap", "0.4", "--measure", "task", "--wrenches", str(task)]
    assert main([*ASKED, *flags, "--out", str(tmp_path)]) == 0
    best = json.loads((tmp_path / "best.json").read_text())
    proof = read_proof(tmp_path / best["proof"])
    assert proof.verify()
    assert best["measure"] == proof.measure.name == "task"
    assert proof.bound == best["bound"] >= best["quality"][0]
    assert {now["bound"] for now in best["history"]} >= {proof.bound}
    # planned contacts keep no distance from edges, and need not be below the bound
    assert all(each["quality"][0] <= each["quality"][1] for each in best["planned"])
    assert best["planned"]
    assert gc.load_grasps(tmp_path / "grasps.json")[0].id == best["grasp"]["id"]
    loads = [[0, 0, -3, 0, 0, 0], [0, 0, -3, 0.02, 0, 0]]
    assert np.allclose(best["wrenches"], loads, rtol=0.0, atol=1e-12)
    assert "multiple" in capsys.readouterr().out


@pytest.mark.parametrize("flags", [["--measure", "task"], ["--wrenches", "task.json"]])
def test_flags_of_measures_that_do_not_fit_are_usage_errors(flags):
    assert main([*ASKED, *flags]) == 2


def planned(tmp_path, *flags):
    assert main(["plan", *flags, "--out", str(tmp_path)]) == Exit.GOOD
    text = (tmp_path / "grasps.json").read_text()
    return json.loads(text), grasps_from_json(text)


def test_optimised_grasps_are_better_and_their_file_says_by_how_much(tmp_path, capsys):
    document, saved = planned(tmp_path, "wedge", "--limit", "2", "--optimize", "--ceiling", "20")
    moves = document["optimization"]
    assert len(moves) == 2
    for move in moves:
        before, after = move["ferrari_canny_before"], move["ferrari_canny_after"]
        assert before[0] < before[1] < after[0] < after[1]
        assert after[0] <= move["ferrari_canny_ceiling"]
        assert move["id"] == f"o-{move['moved_from']}"
    qualities = [grasp.ferrari_canny[0] for grasp in saved.grasps]
    assert qualities == sorted(qualities, reverse=True)
    said = capsys.readouterr().out
    assert "2 of 2 grasps improved; gain from " in said
    assert "upper bound" in said


@pytest.mark.slow
def test_grasps_that_end_at_the_same_contacts_are_kept_once(tmp_path):
    """All families of a tetrahedron are on its four faces; few optima are left of them."""
    document, saved = planned(tmp_path, "tetrahedron", "--optimize")
    assert len(document["optimization"]) == 5
    assert 1 <= len(saved.grasps) < 5
    ids = {move["id"] for move in document["optimization"]}
    assert {grasp.id for grasp in saved.grasps} <= ids
    for i, one in enumerate(saved.grasps):
        for two in saved.grasps[:i]:
            places = [grasp.positions[np.argsort(grasp.faces)] for grasp in (one, two)]
            assert np.abs(places[0] - places[1]).max() > 0.01 * saved.body.radius
