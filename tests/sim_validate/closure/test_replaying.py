"""A trial by itself moves as it did among the others."""

import dataclasses

import pytest

import grasp_core as gc
import sim_validate as sv
from sim_validate.closure.replaying import Recorded, replayed
from sim_validate.commands.exit_codes import Exit
from sim_validate.engine import planned_loads
from sim_validate.engine.held_or_let_go import Outcome
from sim_validate.engine.rig import Rig
from sim_validate.engine.setup import Agenda, NamedWrench, Setup
from sim_validate.main import main
from sim_validate.settings import Noise
from tests.sim_validate.rigs import grasps, plan_with_a_bad_grasp

AGENDA = Agenda(
    random_wrenches=2, wrenches=(NamedWrench("too much", [0.0, 0.0, 90.0, 0.0, 0.0, 0.0]),),
    critical_friction=False, repeats=12, noise=Noise(0.04, 3.0, 3.0, 0.3, 0.3), seed=3,
)  # fmt: skip


@pytest.fixture(scope="module")
def tried():
    body, (grasp,) = grasps("wedge", 0.5, 1)
    verdict = sv.validate(body, grasp, 0.5, agenda=AGENDA)
    known = Recorded(grasp.id, body, grasp.contacts, 0.5, Setup(), AGENDA, grasp=grasp)
    return known, verdict


def same(found, hold):
    assert found.hold.outcome is hold.outcome
    assert found.hold.reason == hold.reason
    assert found.hold.displacement_m == hold.displacement_m
    assert found.hold.rotation_rad == hold.rotation_rad
    assert found.hold.slip_m.tolist() == hold.slip_m.tolist()


def test_every_wrench_comes_out_bit_for_bit(tried):
    known, verdict = tried
    assert len(verdict.wrenches) == 16
    for trial in verdict.wrenches[::3]:
        found = replayed(known, trial.name)
        same(found, trial.hold)
        assert found.predicted_limit == trial.predicted_limit
        assert found.required_friction == trial.required_friction
    assert {trial.hold.outcome for trial in verdict.wrenches} == {Outcome.HELD, Outcome.SLIPPED}


def test_only_the_load_that_is_simulated_is_planned(tried, monkeypatch):
    planned, limit_of = [], planned_loads.limit_of
    monkeypatch.setattr(
        planned_loads, "limit_of", lambda *given: planned.append(given) or limit_of(*given)
    )
    known, verdict = tried
    assert replayed(known, "-torque_z").predicted_limit == next(
        each.predicted_limit for each in verdict.wrenches if each.name == "-torque_z"
    )
    assert len(planned) == 1


def test_a_trial_that_holds_is_simulated_once_unless_its_figures_are_asked_for(tried, monkeypatch):
    known, verdict = tried
    traced, shorter = Rig.traced, []
    monkeypatch.setattr(Rig, "traced", lambda *given: shorter.append(1) or traced(*given))
    for trial in verdict.wrenches[-3:]:
        found = replayed(known, trial.name, as_recorded=False)
        assert found.hold.outcome is trial.hold.outcome
        assert len(shorter) == (trial.hold.outcome is not Outcome.HELD)
        shorter.clear()
        assert replayed(known, trial.name).hold.outcome is trial.hold.outcome
        assert shorter.pop()
    assert {each.hold.outcome for each in verdict.wrenches[-3:]} == {Outcome.HELD, Outcome.SLIPPED}


def test_so_do_negative_controls(tried):
    known, verdict = tried
    count = 0
    for control in verdict.controls:
        about = dataclasses.replace(
            known, contacts=control.control.contacts, friction=control.control.friction,
            control=control.control.name, grasp=None,
        )  # fmt: skip
        for trial in control.tried:
            same(replayed(about, trial.name), trial.hold)
            count += 1
    assert count >= 3


def test_so_do_repeats_with_noise(tried):
    known, verdict = tried
    loaded = missed = 0
    for trial in verdict.robustness.trials:
        about = dataclasses.replace(known, trial=trial.number)
        if "misses its face" in trial.reason:
            with pytest.raises(gc.InputError, match=r"no trial to simulate, .*finger . miss"):
                replayed(about)
            missed += 1
            continue
        found = replayed(about, trial.wrench or None)
        assert found.hold.reason == trial.reason
        assert found.hold.outcome is trial.outcome
        loaded += found.predicted_limit is not None
    assert min(missed, loaded) >= 2


@pytest.mark.slow
def test_contacts_that_noise_opens_let_go_and_so_they_do_by_themselves(tried):
    """Friction just above the critical one: half of the draws are below."""
    known, _ = tried
    noise = Noise(0.0, 0.0, 0.0, 0.1, 0.0)
    agenda = Agenda(controls=False, critical_friction=False, repeats=8, noise=noise)
    friction = 1.02 * known.grasp.critical_friction
    verdict = sv.validate(known.body, known.grasp, friction, agenda=agenda)
    opened = [trial for trial in verdict.robustness.trials if trial.wrench == "separating"]
    assert len(opened) >= 2
    assert not verdict.mismatches
    for trial in opened:
        assert trial.outcome is Outcome.SLIPPED
        about = dataclasses.replace(known, friction=friction, agenda=agenda, trial=trial.number)
        found = replayed(about)
        assert (found.name, found.hold.reason) == (trial.wrench, trial.reason)
        assert found.predicted_limit is None


def test_the_first_wrench_that_was_not_held_is_replayed_unless_another_is_named(tried):
    known, _ = tried
    assert replayed(known).name == "weakest"
    about = dataclasses.replace(known, outcomes={"-force_x": "held", "random_1": "slipped"})
    assert replayed(about).name == "random_1"
    with pytest.raises(gc.InputError, match=r"named 'lift'; choose from \+force_x, .*too much"):
        replayed(known, "lift")


def test_closed_contacts_are_no_control(tried):
    known, _ = tried
    with pytest.raises(gc.InputError, match="are force-closed"):
        replayed(dataclasses.replace(known, control="made_up"))


def test_a_grasp_of_which_nothing_was_simulated_is_refused_with_the_reason(tmp_path, capsys):
    plan = plan_with_a_bad_grasp()
    gc.save_grasps(tmp_path / "grasps.json", plan)
    friction = str(0.999 * max(each.critical_friction for each in plan))
    validate = ["validate", str(tmp_path / "grasps.json"), "--out", str(tmp_path), "-q"]
    assert main([*validate, "--friction", friction]) == Exit.NEGATIVE
    weak = max(plan, key=lambda each: each.critical_friction).id
    capsys.readouterr()
    assert main(["replay", str(tmp_path), "--grasp", weak, "--out", str(tmp_path)]) == Exit.INPUT
    assert "force closure needs friction above" in capsys.readouterr().err
    assert main(["report", str(tmp_path), "-q"]) == Exit.GOOD
