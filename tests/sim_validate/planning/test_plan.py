"""Plans that a time limit or an interrupt ends are kept, say so, and end with an exit code."""

import json
from itertools import count

import pytest

import grasp_core as gc
from grasp_core.objects.on_faces import nearest_edge
from grasp_core.stopping import Stop
from sim_validate.commands.console import Reporter
from sim_validate.commands.exit_codes import Exit
from sim_validate.main import main
from sim_validate.planning import plan as planning
from sim_validate.planning.plan import say_counts
from tests.sim_validate.interrupts import interrupt_once
from tests.sim_validate.rigs import plan_with_a_bad_grasp


def test_a_time_limit_ends_a_plan_without_a_verdict_on_the_object(tmp_path, capsys):
    assert main(["plan", "wedge", "--time-limit-s", "0", "--out", str(tmp_path)]) == Exit.PARTIAL
    shown = capsys.readouterr()
    assert "the time limit ended planning: the plan is not complete" in shown.err
    assert "which proves nothing" in shown.out
    assert json.loads((tmp_path / "grasps.json").read_text())["ended"] == "time"
    found = gc.load_grasps(tmp_path / "grasps.json")
    assert (len(found), found.ended) == (0, "time")


def test_an_interrupt_keeps_the_grasps_that_are_found(tmp_path, monkeypatch, capsys):
    interrupt_once(monkeypatch)
    assert main(["plan", "wedge", "--out", str(tmp_path)]) == Exit.INTERRUPTED
    assert "an interrupt ended planning" in capsys.readouterr().err
    found = gc.load_grasps(tmp_path / "grasps.json")
    assert found.ended == "interrupt"
    assert 0 < len(found) < len(gc.plan(found.body))


def test_a_complete_plan_says_so(tmp_path):
    assert main(["plan", "box", "--limit", "1", "--out", str(tmp_path), "-q"]) == Exit.GOOD
    assert json.loads((tmp_path / "grasps.json").read_text())["ended"] == "done"


@pytest.fixture
def ends_in(monkeypatch):
    """Have the time be up from the second piece of some phase on, whatever the clock says."""

    def chosen(title):
        reporting = planning.Reporter.counted

        def counted(self, named, results, total, word, good, stop):
            looks = count()
            stop = (lambda: next(looks) > 1) if named == title else stop
            return reporting(self, named, results, total, word, good, stop)

        monkeypatch.setattr(planning.Reporter, "counted", counted)
        monkeypatch.setattr(Stop, "why", "time")

    return chosen


@pytest.mark.parametrize(
    ("flag", "phase"), [("--optimize", "optimising"), ("--regions", "certifying")]
)
def test_grasps_that_a_later_phase_has_no_time_for_stay_as_planned(flag, phase, tmp_path, ends_in):
    flags = ["wedge", "--limit", "4", flag, "--out", str(tmp_path), "-q"]
    ends_in(phase)
    assert main(["plan", *flags]) == Exit.PARTIAL
    found = gc.load_grasps(tmp_path / "grasps.json")
    assert (len(found), found.ended) == (4, "time")
    known = {grasp.id: grasp for grasp in gc.plan(found.body, limit=4)}
    changed = sum(grasp != known.get(grasp.id) for grasp in found)
    assert changed <= 2
    if flag == "--optimize":
        assert len(found.moves) == 2
    else:
        regions = json.loads((tmp_path / "regions.json").read_text())
        assert (len(regions["grasps"]), regions["complete"]) == (2, False)


def test_regions_that_there_is_time_for_are_kept(tmp_path, ends_in, capsys):
    assert main(["plan", "wedge", "--limit", "3", "--out", str(tmp_path), "-q"]) == Exit.GOOD
    ends_in("certifying")
    asked = ["regions", str(tmp_path / "grasps.json"), "--out", str(tmp_path), "--max-cones", "300"]
    assert main([*asked, "--time-limit-s", "1000"]) == Exit.PARTIAL
    assert "the time limit ended the proofs after 2 grasps" in capsys.readouterr().err
    regions = json.loads((tmp_path / "regions.json").read_text())
    assert (len(regions["grasps"]), regions["complete"]) == (2, False)


def test_contacts_in_whose_dent_an_edge_lies_are_named(capsys):
    """The second of three grasps has a contact 10 um from a corner."""
    plan = plan_with_a_bad_grasp()
    distances = [nearest_edge(plan.body, grasp) for grasp in plan]
    assert 10.0 * distances[1] < 1e-4 < min(distances[0], distances[2])
    say_counts(plan.body, plan, Reporter())
    (said,) = [line for line in capsys.readouterr().out.splitlines() if "to an edge" in line]
    assert said.startswith("1 grasp with contacts nearer to an edge than 135 um")
    assert said.endswith(f": bad ({1e6 * distances[1]:.3g} um)")
    say_counts(plan.body, plan[:1], Reporter())
    assert "to an edge" not in capsys.readouterr().out
