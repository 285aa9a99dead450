import json
import math
import re
from dataclasses import replace

import numpy as np
import pytest

import grasp_core as gc
import scenes
import sim_validate as sv
from scenes.settings import FingerSettings
from sim_validate.closure import validate as validating
from sim_validate.closure.controls import negative_controls
from sim_validate.closure.verdict import Verdicts, trace_arrays
from sim_validate.commands.exit_codes import Exit
from sim_validate.engine.closure_cases import ClosureCase
from sim_validate.engine.held_or_let_go import Outcome
from sim_validate.engine.kept_gates import checked
from sim_validate.engine.rig import Rig
from sim_validate.engine.setup import Agenda, NamedWrench, Setup
from tests.sim_validate.rigs import grasps, plan_with_a_bad_grasp

WITHOUT_CONTROLS = Agenda(controls=False)


@pytest.mark.parametrize("family", ["pencil", "regulus", "free"])
def test_planned_grasps_hold_all_wrenches_and_no_control_does(family):
    """At theta = 10 degrees; reguli among them need friction."""
    friction = math.tan(math.radians(10.0))
    body, (grasp,) = grasps("tetrahedron", friction, 1, (family,))
    verdict = sv.validate(body, grasp, friction)
    assert verdict.good, (verdict.outcome, verdict.mismatches)
    assert len(verdict.wrenches) == 13
    assert len(verdict.controls) >= 2
    assert verdict.controls_let_go


def test_holding_leaves_a_wide_margin_to_the_threshold():
    """Held displacements are a hundredth of the threshold, so it is not what decides."""
    body, (grasp, *_) = grasps("wedge", 0.5, 1)
    verdict = sv.validate(body, grasp, 0.5, agenda=WITHOUT_CONTROLS)
    worst = max(trial.hold.displacement_m for trial in verdict.wrenches)
    assert worst < 0.03 * verdict.setup.hold.hold_threshold * verdict.scene.layout.grasp_size_m


def test_all_that_can_be_asked_for_repeats_to_the_last_digit_at_any_number_of_threads():
    """All but the random wrenches is the same with another seed, too."""
    body, (grasp, *_) = grasps("wedge", 0.5, 1)
    agenda = Agenda(random_wrenches=2, limits="ramp", keep_traces=True)
    texts, traces = set(), []
    for threads in (1, 2):
        verdict = sv.validate(body, grasp, 0.5, agenda=agenda, setup=Setup(threads=threads))
        texts.add(Verdicts.of(body, 0.5, verdict.gate, (verdict,)).text())
        traces.append(trace_arrays(verdict))
    assert len(texts) == 1
    assert verdict.good
    for name, array in traces[0].items():
        np.testing.assert_array_equal(array, traces[1][name])
    assert {"weakest.slips_m", "random_1.gaps_m", "fingers_removed.separating.times_s"} <= set(
        traces[0]
    )
    asked = replace(WITHOUT_CONTROLS, random_wrenches=2, critical_friction=False, seed=2)
    other = sv.validate(body, grasp, 0.5, agenda=asked)
    same = [
        np.allclose(one.wrench, another.wrench)
        for one, another in zip(verdict.wrenches, other.wrenches, strict=True)
    ]
    assert same == [True] * 13 + [False] * 2


def test_a_users_wrench_is_applied_as_it_is_and_need_not_hold():
    body, (grasp, *_) = grasps("wedge", 0.5, 1)
    small, large = np.array([0, 0, -2.0, 0, 0.05, 0]), np.array([0, 0, -80.0, 0, 0, 0])
    agenda = replace(
        WITHOUT_CONTROLS, wrenches=(NamedWrench("lift", small), NamedWrench("tear", large))
    )
    verdict = sv.validate(body, grasp, 0.5, agenda=agenda)
    lift, tear = verdict.wrenches[-2:]
    np.testing.assert_array_equal(lift.wrench, small)
    assert lift.predicted_limit > 1.0 > tear.predicted_limit > 0.0
    assert lift.hold.outcome is Outcome.HELD
    assert tear.hold.outcome is not Outcome.HELD
    assert tear.hold.reason
    assert not verdict.held
    assert not verdict.good
    assert not verdict.mismatches


def test_what_contradicts_the_analysis_is_said(monkeypatch):
    def slippery(kind):
        faithful = getattr(Rig, kind)

        def weaker(trial):
            watched = np.arange(len(trial.friction)) >= trial.watched
            return replace(trial, friction=np.where(watched, 0.5, 1.0) * trial.friction)

        def weakened(*arguments):
            made = faithful(*arguments)
            trials, *rest = made if isinstance(made, tuple) else (made,)
            weak = [weaker(trial) for trial in trials]
            return (weak, *rest) if rest else weak

        return weakened

    body, (*_, grasp) = grasps("wedge", 0.5, 8, ("free",))
    assert 0.01 < grasp.critical_friction < 0.3
    agenda = replace(WITHOUT_CONTROLS, limits="ramp")
    assert sv.validate(body, grasp, 0.5, agenda=agenda).good
    said = {
        "holds": "though the predicted limit is 1.25", "releases": "critical friction: ",
        "ramps": "the limit was not found near the predicted one",
    }  # fmt: skip
    for kind, words in said.items():
        with monkeypatch.context() as patched:
            patched.setattr(Rig, kind, slippery(kind))
            verdict = sv.validate(body, grasp, 0.5, agenda=agenda)
        assert not verdict.good
        assert any(words in line for line in verdict.mismatches), verdict.mismatches


def test_limits_are_multiples_of_the_applied_wrench():
    body, (grasp, *_) = grasps("wedge", 0.5, 1)
    agenda = replace(WITHOUT_CONTROLS, limits="bisection")
    for trial in sv.validate(body, grasp, 0.5, agenda=agenda).wrenches:
        assert trial.predicted_limit == pytest.approx(1.25, rel=1e-6)
        assert trial.let_go_at.share == pytest.approx(1.0, abs=0.005)


def test_overlapping_fingertips_make_a_grasp_invalid():
    body, (grasp, *_) = grasps("wedge", 0.5, 8, ("free",))
    setup = Setup(fingers=FingerSettings(fingertip_radius_m=0.5 * body.radius))
    verdict = sv.validate(body, grasp, 0.5, agenda=WITHOUT_CONTROLS, setup=setup)
    assert verdict.outcome is Outcome.INVALID_START
    assert "of radius" in verdict.wrenches[0].hold.reason
    assert not verdict.good


BUILT = (
    Setup(fingers=FingerSettings(max_normal_force_n=80.0, approach=(0.0, 0.0, -1.0))),
    Setup(surface="pads"), Setup(surface="object"),
)  # fmt: skip


@pytest.mark.parametrize(
    "setup",
    [
        Setup(fingers=FingerSettings(fingertip_radius_m=0.002)),
        *(pytest.param(each, marks=pytest.mark.slow) for each in BUILT),
    ],
)
def test_limits_do_not_depend_on_how_fingers_are_built_and_on_what_they_touch(setup):
    body, (grasp, *_) = grasps("wedge", 0.5, 1)
    agenda = replace(WITHOUT_CONTROLS, limits="ramp")
    verdict = sv.validate(body, grasp, 0.5, agenda=agenda, setup=setup)
    assert verdict.good, verdict.mismatches
    for trial in verdict.wrenches:
        assert trial.let_go_at.share == pytest.approx(1.0, abs=0.01)


def test_contacts_that_are_not_closed_are_refused_whatever_they_claim():
    """Contacts moved on their faces until closure is lost, with a critical friction of zero."""
    body, (grasp, *_) = grasps("wedge", 0.5, 1)
    controls = {control.name: control for control in negative_controls(body, grasp, 0.5, seed=0)}
    moved = controls["contacts_moved"].contacts
    with pytest.raises(gc.InputError, match="needs friction above"):
        sv.validate(body, replace(grasp, contacts=moved, critical_friction=0.0), 0.5)


def test_a_grasp_of_another_object_is_refused():
    _, (grasp, *_) = grasps("wedge", 0.5, 1)
    for name in ("octahedron", "box"):
        with pytest.raises(gc.InputError, match=r"names face|does not lie on face"):
            sv.validate(scenes.example_object(name), grasp, 0.5)


def test_trials_that_say_nothing_neither_confirm_nor_contradict():
    body, (grasp, *_) = grasps("wedge", 0.5, 1)
    tear = NamedWrench("tear", np.array([0, 0, 1e4, 0, 0, 0]))
    agenda = Agenda(wrenches=(tear,), limits="bisection", keep_traces=True)
    verdict = sv.validate(body, grasp, 0.5, agenda=agenda, setup=Setup(timeout_s=1e-9))
    assert {trial.hold.outcome for trial in verdict.wrenches} == {Outcome.TIMEOUT}
    assert not any(trial.contradiction for trial in verdict.wrenches)
    assert not any(trial.let_go_at for trial in verdict.wrenches)
    assert not any(control.let_go or control.held for control in verdict.controls)
    assert not verdict.controls_let_go
    assert not verdict.good


def test_a_load_that_blows_everything_up_is_recorded_without_numbers():
    body, (grasp, *_) = grasps("wedge", 0.5, 1)
    tear = NamedWrench("tear", np.array([0, 0, 1e9, 0, 1e9, 0]))
    verdict = sv.validate(body, grasp, 0.5, agenda=replace(WITHOUT_CONTROLS, wrenches=(tear,)))
    text = Verdicts.of(body, 0.5, verdict.gate, (verdict,)).text()
    (trial,) = [t for t in json.loads(text)["verdicts"][0]["wrenches"] if t["name"] == "tear"]
    assert trial["outcome"] == "diverged"
    assert not verdict.good


def test_contacts_rounded_to_six_digits_are_as_good():
    """What a file with fewer digits does: contacts are a little above or below their faces."""
    body, (grasp, *_) = grasps("wedge", 0.5, 1)
    rounded = tuple(gc.values.Contact(np.round(c.position, 8), c.normal) for c in grasp.contacts)
    verdict = sv.validate(body, replace(grasp, contacts=rounded), 0.5, agenda=WITHOUT_CONTROLS)
    assert verdict.good, verdict.wrenches[0].hold.reason
    assert verdict.scene.layout.drive.radius_m > 0.01 * body.radius


def test_workers_take_over_how_the_simulator_did(monkeypatch):
    monkeypatch.setattr("sim_validate.processes.workers.UNITS_PER_PROCESS", 1)
    body, found = grasps("wedge", 0.5, 2)
    asked = replace(WITHOUT_CONTROLS, critical_friction=False)
    gate = checked(ClosureCase.of(Setup().for_body(body), 0.5, body.radius))
    assert sv.validate(body, found[0], 0.5, agenda=asked).gate is gate

    def fail(_):
        raise AssertionError("measured again")

    monkeypatch.setattr(ClosureCase, "checks", fail)
    for verdict in sv.validate_all(body, found, 0.5, agenda=asked, jobs=2):
        assert verdict.held
        assert verdict.gate == gate


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_fingertip_that_meets_nothing_is_the_outcome_of_its_grasp_alone(jobs, monkeypatch):
    monkeypatch.setattr("sim_validate.processes.workers.UNITS_PER_PROCESS", 1)
    plan, agenda = plan_with_a_bad_grasp(), replace(WITHOUT_CONTROLS, limits="ramp", repeats=1)
    first, bad, last = sv.validate_all(plan.body, plan, 1.0, agenda=agenda, jobs=jobs)
    assert (first.held, bad.outcome, last.held) == (True, Outcome.INVALID_START, True)
    said = bad.failures[0].hold.reason
    assert re.search(r"fingertip \d, 0.00\d+ mm from an edge of its face, does not touch", said)
    assert "--edge-clearance-m" in said
    assert not bad.mismatches
    assert "nan" not in said


def test_any_error_about_one_grasp_is_its_outcome(monkeypatch):
    body, (grasp, *_) = grasps("wedge", 0.5, 1)
    elsewhere = replace(grasp, id="elsewhere", faces=(*grasp.faces[1:], grasp.faces[0]))
    odd, faithful = replace(grasp, id="odd"), validating.tested

    def failing(body, given, *others):
        if given.id == "odd":
            raise np.linalg.LinAlgError("SVD did not converge")
        return faithful(body, given, *others)

    monkeypatch.setattr(validating, "tested", failing)
    found = sv.validate_all(body, [elsewhere, odd, grasp], 0.5, agenda=WITHOUT_CONTROLS)
    assert [each.outcome for each in found] == [Outcome.ERROR, Outcome.ERROR, Outcome.HELD]
    assert "does not lie on face" in found[0].failures[0].hold.reason
    kept = Verdicts.of(body, 0.5, checked(ClosureCase.of(Setup())), found).text()
    assert Verdicts.of_text(kept).verdicts[1].outcome is Outcome.ERROR
    monkeypatch.setattr(validating, "tested", lambda *_: (_ for _ in ()).throw(MemoryError))
    with pytest.raises(MemoryError):
        sv.validate_all(body, [grasp], 0.5)


def test_commands_go_on_after_a_bad_grasp(tmp_path, answer):
    path = gc.save_grasps(tmp_path / "grasps.json", plan_with_a_bad_grasp())
    found = answer("validate", path, code=Exit.NEGATIVE)["verdicts"]
    assert [each["outcome"] for each in found] == ["held", "invalid_start", "held"]
    judged = answer("validate", path, "--protocol", "molmospaces", code=Exit.NEGATIVE)
    assert [each["held"] for each in judged["judgements"]].count(False) >= 1
    assert "does not touch the object" in judged["judgements"][1]["reason"]
