"""When trials may end: never with another answer than their full length gives.

Loads are from 0.5 to 1.2 times what each grasp resists and frictions from 0.9 to 1.1 times the
critical one, with many close to 1, where verdicts could differ.
"""

from dataclasses import replace

import numpy as np
import pytest

import grasp_core as gc
from sim_validate.closure.controls import control_case, negative_controls
from sim_validate.engine.early_ends import LEAST_WATCHED_SAMPLES, USABLE, EarlyEnds
from sim_validate.engine.held_or_let_go import judge
from sim_validate.engine.planned_loads import LoadPlanner
from sim_validate.engine.rig import squeezed
from sim_validate.engine.schedules import Thresholds, part
from sim_validate.engine.setup import Agenda, Setup
from sim_validate.engine.simulated_friction import forces_just_above
from sim_validate.engine.stepping import Bench
from sim_validate.settings import HoldProtocol
from tests.marks import more
from tests.sim_validate.engine.test_held_or_let_go import pose
from tests.sim_validate.rigs import grasps, limiting_loads

SAMPLE_S = 0.01
LENGTH = 66
LAST_OF_SETTLING = 25
RESTING = np.zeros(18)
"""Speeds of the object and of four fingers."""
SHARES = (0.5, 0.8, 0.95, 0.99, 0.998, 1.002, 1.01, 1.05, 1.2)
"""Loads, relative to the largest that the analysis says is resisted."""
NEAR = (0.9, 0.99, 0.997, 0.999, 1.0, 1.0006, 1.001, 1.002, 1.004, 1.01, 1.03, 1.1)
"""Frictions, relative to the critical one."""


def compared(body, grasp, friction):
    """How each trial ends at its full length and once its answer is known, and how long each is."""
    held = [*of_holds(body, grasp, friction), *of_controls(body, grasp, friction)]
    return [*held, *of_releases(body, grasp)]


def of_holds(body, grasp, friction):
    setup = Setup()
    scene = setup.scene(body, grasp, friction)
    rig = squeezed(Bench(scene), setup, scene.layout.squeeze_forces, friction)
    planned = LoadPlanner(body, grasp.contacts, friction, setup, None).planned(rig.idle, Agenda())
    loads = [part(rig.idle, each.limit, share) for each in planned for share in SHARES]
    return judged(rig, loads)


def of_controls(body, grasp, friction):
    exact = replace(grasp, critical_friction=gc.critical_friction(grasp))
    for control in negative_controls(body, exact, friction, 0):
        rig, loads = control_case(body, control, Setup())
        settling = [each.settling for each in loads]
        yield from judged(rig, [each.load for each in loads], settling)


def judged(rig, loads, settling=None):
    layout, protocol = rig.bench.scene.layout, rig.setup.hold
    trials = rig.holds(loads, settling)
    for traces in zip(replace(rig, whole=True).traced(trials), rig.traced(trials), strict=True):
        whole, early = (judge(trace, layout, protocol) for trace in traces)
        yield whole.outcome, early.outcome, *(len(trace.times_s) for trace in traces)


def of_releases(body, grasp):
    setup, predicted = Setup(), gc.critical_friction(grasp)
    protocol = setup.friction
    least = max(predicted, protocol.least_friction)
    high = protocol.settling_friction * least
    try:
        forces = forces_just_above(grasp.positions, grasp.normals, least)
    except gc.UndecidedError:
        return
    forces *= 0.6 * setup.fingers.max_normal_force_n
    bench = Bench(setup.scene(body, grasp, least))
    rig = squeezed(bench, setup, forces, least, high)
    limit = min(protocol.threshold, 2e-3 * least) * bench.scene.layout.grasp_size_m
    frictions = [near * least for near in NEAR]
    resting = rig.at_rest(high)
    whole = rig.traced(rig.releases(high, frictions))
    early = resting.traced(resting.releases(high, frictions, limit))
    for traces in zip(whole, early, strict=True):
        yield *(trace.stayed(limit) for trace in traces), *(len(each.times_s) for each in traces)


@pytest.fixture
def looking(held):
    """One trial that squeezes without a wrench, looked at from the last sample of settling on."""
    _, _, rig = held
    layout = rig.bench.scene.layout
    limit = 2e-4 * layout.grasp_size_m
    return EarlyEnds(layout, rig.holds([rig.idle]), SAMPLE_S, Thresholds(limit, limit))


def look(ends, sample, joints, speeds=RESTING):
    """Whether the trial is settled in a sample, and whether its answer is known."""
    looked = ends.look(np.array([0]), np.array([sample]), joints[None], speeds[None])
    return tuple(bool(each[0]) for each in looked)


def test_verdicts_are_those_of_the_full_length(held):
    body, grasp, _ = held
    wholes, earlies, long, short = zip(*compared(body, grasp, 0.5), strict=True)
    assert len(wholes) > 100
    assert len(set(wholes)) >= 3
    assert wholes == earlies
    assert sum(short) < 0.3 * sum(long)


@pytest.mark.parametrize("name", more("l-bracket", "random-20-7"))
def test_verdicts_of_thousands_of_trials_are_those_of_the_full_length(name):
    pairs = []
    for friction in (0.2, 0.5, 0.8):
        body, found = grasps(name, friction, 6, ("concurrent", "pencil", "regulus", "free"))
        pairs += [pair for grasp in found for pair in compared(body, grasp, friction)]
    assert len(pairs) > 1000
    assert all(whole == early for whole, early, *_ in pairs)


def test_held_objects_move_no_farther_than_the_bound_to_the_end(held):
    body, grasp, rig = held
    limits = limiting_loads(body, grasp, 0.5, 12)
    loads = [part(rig.idle, limit, share) for limit in limits for share in (0.3, 0.8, 0.95)]
    limit = HoldProtocol().hold_threshold * rig.bench.scene.layout.grasp_size_m
    ended = 0
    trials = rig.holds(loads)
    wholes = replace(rig, whole=True).traced(trials)
    for whole, early in zip(wholes, rig.traced(trials), strict=True):
        assert len(whole.times_s) == 40
        if len(early.times_s) < 40:
            assert whole.start_m + whole.displacements_m.max() < USABLE * limit
            ended += 1
    assert ended >= 30


def moves(which, size):
    """The object shifts or turns, or a finger slides; lengths in grasp sizes."""

    def change(_, speeds, ends):
        speeds[which] = size * (1.0 if which == 4 else ends.layout.grasp_size_m)

    return change


def leans(share):
    """It creeps, and the push of a finger is at this share of its friction cone."""

    def change(_, speeds, ends):
        speeds[0] = 1e-6 * ends.layout.grasp_size_m
        pushes = ends.commands.reshape(1, 4, 3)
        pushes[0, 0, 1:] = share * 0.5 * pushes[0, 0, 0], 0.0

    return change


def pushes(share):
    """A servo pushes with this share of what it can."""

    def change(_joints, _speeds, ends):
        largest = ends.layout.drive.max_normal_force_n
        ends.commands.reshape(1, 4, 3)[0, 2] = share * largest, 0.0, 0.0

    return change


@pytest.mark.parametrize(
    ("change", "ended"),
    [(lambda *_: None, True), (lambda joints, *_: joints.fill(np.nan), False),
     (moves(0, 0.01), False), (moves(4, 0.01), False), (moves(8, 0.01), False),
     (leans(0.5), True), (leans(1.0 - 1e-7), False), (leans(1.0), False), (leans(1.5), False),
     (pushes(1.0), False), (pushes(0.0), False), (pushes(-0.1), False)],
)  # fmt: skip
def test_a_trial_ends_once_it_was_watched_where_nothing_can_change_the_answer(
    looking, change, ended
):
    joints, speeds = pose(), np.zeros(18)
    change(joints, speeds, looking)
    samples = range(LAST_OF_SETTLING, LAST_OF_SETTLING + 6)
    said = [look(looking, sample, joints, speeds)[1] for sample in samples]
    assert said == [False] * LEAST_WATCHED_SAMPLES + [ended] * (6 - LEAST_WATCHED_SAMPLES)


def test_a_change_of_speed_keeps_a_trial_going(looking):
    """A shaken object whose speed happens to be zero when it is looked at."""
    moving = RESTING.copy()
    moving[1] = 0.01 * looking.layout.grasp_size_m
    for sample in range(LAST_OF_SETTLING, LAST_OF_SETTLING + 8):
        assert not look(looking, sample, pose(), moving if sample % 2 else RESTING)[1]


def test_an_object_beyond_half_of_a_threshold_is_watched_to_the_end(looking):
    for share, ended in ((0.4, True), (0.6, False)):
        joints = pose()
        look(looking, LAST_OF_SETTLING, joints)
        joints[0] = share * looking.thresholds.watched_m
        samples = range(LAST_OF_SETTLING + 1, LENGTH)
        assert any([look(looking, sample, joints)[1] for sample in samples]) is ended


@pytest.mark.parametrize("before", [False, True])
def test_an_object_that_is_or_was_moved_too_far_is_answered_at_once(looking, before):
    """What moved before friction was lowered counts as well."""
    far = pose((0.0, 0.0, 1.01 * looking.thresholds.total_m))
    look(looking, LAST_OF_SETTLING, far if before else pose())
    assert look(looking, LAST_OF_SETTLING + 1, far)[1]


def test_settling_ends_when_the_object_is_calm_and_not_before(looking):
    said = [look(looking, sample, pose())[0] for sample in range(15, 18)]
    assert said == [False, True, True]
    creeping = RESTING.copy()
    creeping[0] = 1e-3 * looking.layout.grasp_size_m
    assert not look(looking, 18, pose(), creeping)[0]


def test_rigid_fingertips_end_only_by_loss(held):
    layout = held[2].bench.scene.layout
    rigid = replace(layout, drive=replace(layout.drive, rigid=True))
    (trial,) = held[2].releases(1.0, [0.5])
    ends = EarlyEnds(rigid, [trial], SAMPLE_S, Thresholds(1e-6))
    still, lost = pose()[:7], pose((2e-6, 0.0, 0.0))[:7]
    for sample in range(40):
        joints = lost if sample >= 30 else still
        assert look(ends, sample, joints, np.zeros(6)) == (False, sample >= 30)
    assert trial.watched == 10
