"""Losses count only where short steps find them too; what the simulator cannot follow is lost."""

from dataclasses import replace

import numpy as np
import pytest

import grasp_core as gc
import scenes
import sim_validate as sv
from sim_validate.engine.stepping import Health
from sim_validate.execution import confirming, holders
from sim_validate.execution.confirming import (
    FINE_S,
    NEAR_LOSS,
    confirmed_trials,
    confirming_benches,
    run_again,
    run_trials,
)
from sim_validate.execution.execute import SpringFingers
from sim_validate.execution.predictions import HeldDynamics
from sim_validate.execution.simulate import HeldBench, outcome
from sim_validate.execution.trials import trials_of
from sim_validate.execution.verdict import trial_in_words
from tests.sim_validate.execution.held_rigs import planned

LIGHT = sv.ExecutionSettings(0.00537, trials=("stop",))
"""A bar of 5 g between fingertips of 50 g, one of which pushes with 0.15 N."""


@pytest.fixture(scope="module")
def bar():
    """A grasp whose bar rattles between its fingers when the palm stops."""
    body = scenes.example_object("double-wedge-bar")
    plan = gc.plan(body, 0.4, families=("free",), limit=6, rank_by="diverse")
    return body, plan["f-0-1-3-4"]


def test_a_loss_of_a_step_that_is_too_long_does_not_count(bar, monkeypatch):
    found = {trial.name: trial for trial in sv.execute(*bar, 0.4, LIGHT).trials}
    monkeypatch.setattr(confirming, "confirming_benches", lambda _: iter(()))
    once = {trial.name: trial for trial in sv.execute(*bar, 0.4, LIGHT).trials}
    lost = {name for name, trial in once.items() if not trial.survived}
    assert "stop -y" in lost
    assert once["stop -y"].displacement_m > 0.05
    for name, trial in found.items():
        assert trial.survived, name
        assert trial.displacement_m < 0.002, name
        assert (trial.step_s == pytest.approx(FINE_S)) == (name in lost), name
        if name not in lost:
            assert trial == once[name]


def test_the_motion_of_a_kept_object_is_that_of_short_steps_where_it_nears_a_limit(
    bar, monkeypatch
):
    """A limit of 1.2 mm, of which one kept stop uses up more than .3; the others say so."""
    settings = replace(LIGHT, max_mm=1.2)
    found = {trial.name: trial for trial in sv.execute(*bar, 0.4, settings).trials}
    usual, near_m = found["stop +z"].step_s, NEAR_LOSS * settings.most_m
    monkeypatch.setattr(confirming, "confirming_benches", lambda _: iter(()))
    once = {trial.name: trial for trial in sv.execute(*bar, 0.4, settings).trials}
    near = [
        name for name, trial in once.items()
        if trial.survived and trial.fate == "slipped" and trial.displacement_m > near_m
    ]  # fmt: skip
    assert near == ["stop +y"]
    for name, trial in once.items():
        again = name in near or not trial.survived
        assert (found[name].step_s < usual) == again, name
        assert again or found[name] == trial, name
    assert once["stop +y"].displacement_m != found["stop +y"].displacement_m
    for trial in found.values():
        kept = trial.survived and (trial.fate == "stuck" or trial.step_s < usual)
        assert trial.converged == kept, trial.name
    assert {trial.converged for trial in found.values()} == {True, False}


def trials_on_a_bench(settings):
    """The box on its bench, the trials of some settings, their motions, and the frictions."""
    body, grasp = planned("box")
    fingers = SpringFingers(body, grasp.contacts, 0.5)
    best = fingers.squeeze(settings)
    scene = fingers.scene(settings, best)
    bench = HeldBench(scene)
    lowest = HeldDynamics(best.grip, scene.layout).lowest_frequency
    trials, _ = trials_of(body, scene.layout, settings, lowest)
    return bench, run_trials(bench, trials), best.grip.friction


@pytest.mark.parametrize("kind", ["shake", "stop"])
def test_a_run_that_goes_on_at_the_same_steps_is_the_first_one(kind):
    """Motions are joined where they were parted, with the speed that a stop begins with."""
    settings = sv.ExecutionSettings(0.8, trials=(kind,), max_mm=5e3, max_deg=180.0)
    bench, motions, friction = trials_on_a_bench(settings)
    slipped = 0
    for trial, again in run_again(bench, motions, settings).items():
        motion = motions[trial]
        first, second = (
            outcome(each, trial.drive, friction, trial.begun) for each in (motion, again)
        )
        slipped += first.slipped
        assert len(again.moved) == len(motion.moved)
        # a stop that goes on from before its weight moves through the world for longer
        assert second.displacement_m == pytest.approx(first.displacement_m, rel=1e-3), trial.name
        assert second.dropped == first.dropped
    assert slipped


def test_one_trial_that_diverges_loses_one_trial(monkeypatch):
    body, grasp = planned("box")
    settings = sv.ExecutionSettings(0.1, trials=("weight", "knock"))
    plain = sv.execute(body, grasp, 0.5, settings)
    judged = confirming._judged

    def diverging(trial, motion, *more, **settled):
        if trial.name == "knock -y":
            motion = replace(motion, health=Health(finite=False))
        return judged(trial, motion, *more, **settled)

    monkeypatch.setattr(confirming, "_judged", diverging)
    found = sv.execute(body, grasp, 0.5, settings)
    assert len(found.trials) == 7
    for one, other in zip(found.trials, plain.trials, strict=True):
        if one.name == "knock -y":
            assert (one.fate, one.survived, one.displacement_m) == ("diverged", False, np.inf)
            assert "could not follow" in trial_in_words(one)
        else:
            assert one == other


def test_a_loss_of_which_nothing_says_when_it_begins_is_run_again_as_a_whole():
    """Contacts may slip within samples only; then no sample has one on its cone."""
    settings = sv.ExecutionSettings(0.1, trials=("weight",))
    bench, motions, _ = trials_on_a_bench(settings)
    (motion,) = motions.values()
    half, short = confirming_benches(bench)
    assert (half.chunk, short.step_s) == (2 * bench.chunk, pytest.approx(FINE_S))
    assert not list(confirming_benches(short))  # short steps are not made shorter
    (again,) = run_again(short, motions, settings).values()
    assert len(again.moved) == len(motion.moved)
    assert np.array_equal(again.moved[0], motion.moved[0])
    assert (again.moved[1:] != motion.moved[1:]).any(axis=1).all()


def test_half_the_steps_confirm_only_what_is_predicted_too():
    settings = sv.ExecutionSettings(1.5, trials=("stop",))
    bench, motions, _ = trials_on_a_bench(settings)
    for loss, steps in ((0.8, 2 * bench.chunk), (1.0, bench.sample_s / FINE_S)):
        predicted = dict.fromkeys(motions, (0.5, loss))
        found = confirmed_trials(bench, motions, predicted, settings)
        for trial in found.values():
            assert not trial.survived, trial.name
            assert trial.step_s == pytest.approx(bench.sample_s / steps), trial.name


def test_an_object_that_closing_fingers_throw_about_is_run_again_as_a_whole(bar):
    """A bar of 5 g, which steps of the usual length drop from fingers that meet it misplaced."""
    settings = replace(LIGHT, trials=("misplaced",))
    fingers = SpringFingers(bar[0], bar[1].contacts, 0.4)
    scene, dynamics, trials, _ = holders.planned(fingers, settings, fingers.squeeze(settings))
    bench = HeldBench(scene)
    motions = run_trials(bench, trials)
    predicted = dict(zip(trials, dynamics.losses(trials, settings), strict=True))
    found = confirmed_trials(bench, motions, predicted, settings)
    first = [outcome(motions[t], t.drive, scene.layout.friction, t.begun) for t in trials]
    assert {each.dropped for each in first} == {True, False}
    *_, short = confirming_benches(bench)
    for trial, motion in run_trials(short, trials).items():
        right = outcome(motion, trial.drive, scene.layout.friction, trial.begun)
        assert found[trial].survived
        assert found[trial].displacement_m == right.displacement_m, trial.name
