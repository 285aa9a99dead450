"""When trials may end: never with another answer than their full length gives."""

from dataclasses import replace

import numpy as np
import pytest

import grasp_core as gc
from sim_validate.closure.controls import control_case, negative_controls
from sim_validate.engine.bench import Load
from sim_validate.engine.rig import part
from sim_validate.engine.setup import Setup
from sim_validate.engine.traces import USABLE, WATCHED, EarlyEnds, Outcome, Thresholds, judge
from sim_validate.settings import HoldProtocol
from tests.marks import more
from tests.sim_validate.engine.test_traces import pose
from tests.sim_validate.engine.whole_and_early import compared
from tests.sim_validate.rigs import grasps, limiting_loads, rig_of

SAMPLE_S = 0.01
LENGTH = 66
LAST_OF_SETTLING = 25


@pytest.fixture(scope="module")
def held():
    body, (grasp, *_) = grasps("random-12-1", 0.5, 1)
    return body, grasp, rig_of(body, grasp, 0.5)


@pytest.fixture
def looking(held):
    """One trial that squeezes without a wrench, looked at from the last sample of settling on."""
    _, _, rig = held
    layout = rig.bench.scene.layout
    limit = 2e-4 * layout.grasp_size_m
    return EarlyEnds(layout, rig.holds([rig.idle]), SAMPLE_S, Thresholds(limit, limit))


def answers(ends, joints, speeds, count=6):
    """What it says in each sample from the last one of settling on."""
    said = []
    for sample in range(LAST_OF_SETTLING, LAST_OF_SETTLING + count):
        _, answered = ends.look(np.array([0]), np.array([sample]), joints[None], speeds[None])
        said.append(bool(answered[0]))
    return said


def at_rest():
    return pose(), np.zeros(18)


def test_verdicts_are_those_of_the_full_length(held):
    """At loads and frictions around the limits, where a difference would show."""
    body, grasp, _ = held
    pairs = compared((body, grasp, 0.5))
    assert len(pairs) > 100
    assert len({pair.whole for pair in pairs}) >= 2
    assert all(pair.whole == pair.early for pair in pairs)
    whole, early = np.sum([pair.samples for pair in pairs], axis=0)
    assert early < 0.3 * whole


@pytest.mark.parametrize("name", more("box", "tetrahedron", "l-bracket", "random-20-7"))
def test_verdicts_of_thousands_of_trials_are_those_of_the_full_length(name):
    pairs = []
    for friction in (0.2, 0.5, 0.8):
        body, found = grasps(name, friction, 6, ("concurrent", "pencil", "regulus", "free"))
        pairs += [pair for grasp in found for pair in compared((body, grasp, friction))]
    assert len(pairs) > 1000
    assert all(pair.whole == pair.early for pair in pairs)


def test_an_ended_release_is_the_beginning_of_the_whole_one(held):
    body, (grasp, *_) = grasps("random-12-1", 0.5, 1, ("regulus",))
    rig, size = rig_of(body, grasp, 0.5), held[2].bench.scene.layout.grasp_size_m
    whole, ended = rig.release(1.5, [0.5]), rig.at_rest(1.5).release(1.5, [0.5], 2e-5 * size)
    count = len(ended[0].times_s)
    assert WATCHED <= count < len(whole[0].times_s) == 40
    for name in ("displacements_m", "slips_m", "gaps_m", "touched_m", "rotations_rad"):
        np.testing.assert_array_equal(getattr(ended[0], name), getattr(whole[0], name)[:count])
    assert ended[0].start_m == whole[0].start_m


def test_held_objects_move_no_farther_than_the_bound_to_the_end(held):
    body, grasp, rig = held
    limits = limiting_loads(body, grasp, 0.5, 12)
    loads = [part(rig.idle, limit, share) for limit in limits for share in (0.3, 0.8, 0.95)]
    limit = HoldProtocol().hold_threshold * rig.bench.scene.layout.grasp_size_m
    ended = 0
    wholes = replace(rig, whole=True).hold(loads)
    for whole, early in zip(wholes, rig.hold(loads), strict=True):
        assert len(whole.times_s) == 40
        if len(early.times_s) < 40:
            assert whole.start_m + whole.displacements_m.max() < USABLE * limit
            ended += 1
    assert ended >= 30


def test_a_trial_ends_in_the_same_sample_alone_and_beside_one_that_is_lost(held):
    body, grasp, rig = held
    limits = limiting_loads(body, grasp, 0.5, 6)
    held_loads = [part(rig.idle, limit, share) for limit in limits for share in (0.3, 0.7, 0.9)]
    lost = [part(rig.idle, limits[0], 1.3)]
    beside = rig.hold(held_loads + lost)
    assert len(beside[-1].times_s) < 40
    for load, together in zip(held_loads, beside[:-1], strict=True):
        (alone,) = rig.hold([load])
        assert len(alone.times_s) == len(together.times_s)
        np.testing.assert_array_equal(alone.displacements_m, together.displacements_m)


def test_contacts_nearly_on_a_line_end_only_when_lost(held, looking):
    """Their levers are shorter than the size that the bound is told with."""
    layout = looking.layout
    wide = replace(layout, grasp_size_m=1.01 * layout.grasp_size_m)
    trials = held[2].holds([held[2].idle])
    limits = Thresholds(layout.grasp_size_m, layout.grasp_size_m)
    assert EarlyEnds(layout, trials, SAMPLE_S, limits).springs is not None
    assert EarlyEnds(wide, trials, SAMPLE_S, limits).springs is None


def test_controls_end_in_the_sample_in_which_they_let_go():
    body, (grasp, *_) = grasps("wedge", 0.5, 1)
    grasp = replace(grasp, critical_friction=gc.critical_friction(grasp))
    layouts = 0
    for control in negative_controls(body, grasp, 0.5, 0):
        rig, loads = control_case(body, control, Setup())
        settling = [each.settling for each in loads]
        for found in rig.hold([each.load for each in loads], settling):
            verdict = judge(found, rig.bench.scene.layout, HoldProtocol())
            assert verdict.outcome in (Outcome.SLIPPED, Outcome.LOST_CONTACT)
            assert verdict.failed_after_s == pytest.approx(found.times_s[-1])
            layouts += 1
    assert layouts >= 4


def test_an_object_at_rest_is_answered_once_it_was_watched(looking):
    assert answers(looking, *at_rest()) == [False] * WATCHED + [True] * (6 - WATCHED)


@pytest.mark.parametrize(("which", "sizes"), [(0, 0.01), (4, None), (8, 0.01)])
def test_an_object_or_finger_that_still_moves_keeps_a_trial_going(looking, which, sizes):
    """It shifts, turns, or one of its fingers slides."""
    joints, speeds = at_rest()
    speeds[which] = 0.01 if sizes is None else sizes * looking.layout.grasp_size_m
    assert not any(answers(looking, joints, speeds))


def test_a_change_of_speed_keeps_a_trial_going(looking):
    """A shaken object whose speed happens to be zero when it is looked at."""
    joints, speeds = at_rest()
    moving = speeds.copy()
    moving[1] = 0.01 * looking.layout.grasp_size_m
    for sample in range(LAST_OF_SETTLING, LAST_OF_SETTLING + 8):
        now = moving if sample % 2 else speeds
        _, answered = looking.look(np.array([0]), np.array([sample]), joints[None], now[None])
        assert not answered.any()


def test_a_contact_at_the_border_of_its_cone_keeps_a_trial_going(looking):
    joints, speeds = at_rest()
    speeds[0] = 1e-6 * looking.layout.grasp_size_m  # as creep
    normal = looking.commands.reshape(1, 4, 3)[0, 0, 0]
    for share, ended in ((0.5, True), (1.0 - 1e-7, False), (1.0, False), (1.5, False)):
        looking.commands.reshape(1, 4, 3)[0, 0, 1:] = share * 0.5 * normal, 0.0
        assert any(answers(looking, joints, speeds)) is ended


def test_a_servo_at_its_limit_or_without_a_push_keeps_a_trial_going(looking):
    largest = looking.layout.drive.max_normal_force_n
    for push in (largest, 0.0, -1.0):
        looking.commands.reshape(1, 4, 3)[0, 2] = push, 0.0, 0.0
        assert not any(answers(looking, *at_rest()))


def test_an_object_beyond_half_of_a_threshold_is_watched_to_the_end(looking):
    for share, ended in ((0.4, True), (0.6, False)):
        joints, speeds = at_rest()
        looking.look(np.array([0]), np.array([LAST_OF_SETTLING]), joints[None], speeds[None])
        joints[0] = share * looking.thresholds.watched_m
        said = [
            looking.look(np.array([0]), np.array([sample]), joints[None], speeds[None])[1][0]
            for sample in range(LAST_OF_SETTLING + 1, LENGTH)
        ]
        assert any(said) is ended


def test_a_lost_object_is_answered_at_once(looking):
    joints, speeds = at_rest()
    looking.look(np.array([0]), np.array([LAST_OF_SETTLING]), joints[None], speeds[None])
    joints[2] = 1.01 * looking.thresholds.watched_m
    speeds[2] = 1.0
    (answered,) = looking.look(np.array([0]), np.array([26]), joints[None], speeds[None])[1]
    assert answered


def test_what_moved_before_friction_was_lowered_counts(looking):
    joints, speeds = at_rest()
    joints[1] = 1.01 * looking.thresholds.total_m
    looking.look(np.array([0]), np.array([LAST_OF_SETTLING]), joints[None], speeds[None])
    (answered,) = looking.look(np.array([0]), np.array([26]), joints[None], speeds[None])[1]
    assert answered


def test_numbers_that_are_none_answer_nothing(looking):
    joints, speeds = at_rest()
    joints[:] = speeds[:] = np.nan
    assert not any(answers(looking, joints, speeds))


def test_settling_ends_when_the_object_is_calm_and_not_before(looking):
    joints, speeds = at_rest()
    place = np.array([0])
    said = [
        looking.look(place, np.array([sample]), joints[None], speeds[None])[0][0]
        for sample in range(15, 18)
    ]
    assert said == [False, True, True]
    speeds[0] = 1e-3 * looking.layout.grasp_size_m
    assert not looking.look(place, np.array([18]), joints[None], speeds[None])[0][0]


def test_rigid_fingertips_end_only_by_loss(held):
    layout = held[2].bench.scene.layout
    rigid = replace(layout, drive=replace(layout.drive, rigid=True))
    (trial,) = held[2].releases(1.0, [0.5])
    ends = EarlyEnds(rigid, [trial], SAMPLE_S, Thresholds(1e-6))
    still, lost = pose()[:7], pose((2e-6, 0.0, 0.0))[:7]
    for sample in range(40):
        joints = lost if sample >= 30 else still
        settled, answered = ends.look(
            np.array([0]), np.array([sample]), joints[None], np.zeros((1, 6))
        )
        assert not settled[0]
        assert answered[0] == (sample >= 30)
    assert trial.watched == 10


def test_a_bench_forgets_earlier_trials(held):
    """Room for trials is made once; a blow-up must leave nothing behind."""
    body, grasp, rig = held
    fresh = rig_of(body, grasp, 0.5)
    still = Load(np.zeros(6), rig.idle.forces)
    fresh.hold([Load(np.full(6, 1e14), rig.idle.forces)] * 3)
    (after,), (before,) = (replace(each, whole=True).hold([still]) for each in (fresh, rig))
    np.testing.assert_array_equal(after.displacements_m, before.displacements_m)
    assert after.health.warnings == before.health.warnings == 0
    assert after.health.finite
