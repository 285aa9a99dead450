"""How the simulator is started, stepped and kept quiet."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest
from mujoco import batch

import grasp_core as gc
from grasp_core.arrays import to_digits
from scenes.silent_mujoco import unlogged
from sim_validate.engine import stepping
from sim_validate.engine.held_or_let_go import Outcome, judge
from sim_validate.engine.schedules import TrialLoad, part
from sim_validate.engine.stepping import CLOSURE_STEPS, Bench, compiled
from sim_validate.settings import HoldProtocol
from tests.sim_validate.rigs import limiting_loads


def trials_of(held, count=5):
    """Holds below and above the limits, so that some of the objects slip."""
    body, grasp, rig = held
    limits = limiting_loads(body, grasp, 0.5, count)
    shares = np.linspace(0.8, 1.2, count)
    return rig.holds(
        [part(rig.idle, limit, share) for limit, share in zip(limits, shares, strict=True)]
    )


def plain_loop(scene, schedule, start):
    """The same trial with `mj_step` alone."""
    model = mujoco.MjModel.from_xml_string(scene.xml)
    data = mujoco.MjData(model)
    mujoco.mj_setState(model, data, start, mujoco.mjtState.mjSTATE_INTEGRATION)
    layout, rows = scene.layout, []
    touching = [i for i in range(model.ngeom) if model.geom_contype[i] or model.geom_conaffinity[i]]
    local = to_digits(np.einsum("kij,nki->nkj", layout.frames, schedule.forces))
    torques = schedule.wrenches[:, 3:] - np.cross(layout.center, schedule.wrenches[:, :3])
    wrenches = np.hstack([to_digits(schedule.wrenches[:, :3]), to_digits(torques)])
    for wrench, pushes, friction in zip(wrenches, local, to_digits(schedule.friction), strict=True):
        data.ctrl[:] = pushes.ravel() / layout.drive.stiffness_n_per_m
        data.xfrc_applied[model.body("object").id] = wrench
        model.geom_friction[touching, 0] = friction
        mujoco.mj_step(model, data, nstep=CLOSURE_STEPS)
        rows.append(data.qpos.copy())
    return np.array(rows)


@pytest.mark.parametrize("threads", [1, 3])
def test_trials_together_are_those_of_a_plain_loop_to_the_last_bit(held, threads):
    _, _, rig = held
    trials = trials_of(held)
    scene = rig.bench.scene
    told = [trial.told(scene.layout) for trial in trials]
    motions = Bench(scene, threads=threads).simulated(told, rig.closed.state)
    for motion, trial in zip(motions, trials, strict=True):
        np.testing.assert_array_equal(motion.joints, plain_loop(scene, trial, rig.closed.state))
    moved = [np.abs(motion.joints[-1, :3]).max() for motion in motions]
    assert max(moved) > 100.0 * min(moved)


def seen_each_time(_going, samples, _joints, _speeds):
    """A look at every sample, which ends nothing."""
    return samples + 1


@pytest.mark.parametrize("wrench", [0.0, 1e14])
def test_samples_in_one_call_are_those_that_are_looked_at_to_the_last_bit(held, wrench):
    """What diverges or warns, too: after the call that does, samples are simulated one by one."""
    _, _, rig = held
    scene, wild = rig.bench.scene, TrialLoad(np.full(6, wrench), rig.idle.forces)
    trials = [*trials_of(held), *rig.holds([wild])]
    told = [trial.told(scene.layout) for trial in trials]
    bench = Bench(scene, kept=("qvel", "state"))
    pairs = zip(
        bench.simulated(told, rig.closed.state),
        bench.simulated(told, rig.closed.state, seen_each_time),
        strict=True,
    )
    for together, alone in pairs:
        assert together.health == alone.health
        series = zip((together.joints, *together.kept), (alone.joints, *alone.kept), strict=True)
        for one, other in series:
            np.testing.assert_array_equal(one, other)
    assert bool(together.health.fault) == (wrench > 0.0)


def test_trials_without_frictions_have_the_scenes_after_trials_that_changed_them(held, monkeypatch):
    """Batches of MuJoCo 3.17 cannot say which frictions were changed."""
    monkeypatch.delattr(batch.Batch, "expanded", raising=False)
    _, _, rig = held
    scene, slippery = rig.bench.scene, trials_of(held, 2)
    told = [replace(trial.told(scene.layout), friction=None) for trial in slippery]
    used = Bench(scene)
    used.simulated([replace(each, friction=np.full((1, 1), 1e-3)) for each in told])
    for now, alone in zip(used.simulated(told), Bench(scene).simulated(told), strict=True):
        np.testing.assert_array_equal(now.joints, alone.joints)


def test_a_good_hold_beside_a_blow_up_is_judged_on_its_own(held):
    _, _, rig = held
    still = TrialLoad(np.zeros(6), rig.idle.forces)
    layout = rig.bench.scene.layout
    together = rig.traced(rig.holds([still, TrialLoad(np.full(6, 1e14), rig.idle.forces), still]))
    assert abs(together[1].health.clock_error_s) < 1e-9  # it is reported, and not reset
    outcomes = [judge(found, layout, HoldProtocol()).outcome for found in together]
    assert outcomes == [Outcome.HELD, Outcome.DIVERGED, Outcome.HELD]
    (alone,) = rig.traced(rig.holds([still]))
    np.testing.assert_array_equal(alone.displacements_m, together[2].displacements_m)


def test_a_trial_that_diverges_stays_as_it_is(held):
    """Steps with numbers that are not finite take a hundred times as long."""
    _, _, rig = held
    (wild,) = rig.holds([TrialLoad(np.full(6, 1e14), rig.idle.forces)])
    bench = Bench(rig.bench.scene, kept=("time",))
    (motion,) = bench.simulated([wild.told(bench.scene.layout)], rig.closed.state)
    (times,) = motion.kept
    assert len(motion.joints) == len(wild.forces)
    assert motion.health.fault
    last = int(np.argmax(times))
    assert last < 0.1 * len(times)
    assert (times[last:] == times[last]).all()
    still = np.broadcast_to(motion.joints[last], motion.joints[last:].shape)
    np.testing.assert_array_equal(motion.joints[last:], still)


def test_text_that_is_no_scene_is_refused():
    for text in ("", "<mujoco", "<mujoco><nonsense/></mujoco>"):
        with pytest.raises(gc.InputError, match="MuJoCo cannot compile the scene"):
            compiled(text)


def test_warnings_leave_no_file_behind(tmp_path, monkeypatch):
    """A state that is not a number makes the simulator warn."""
    monkeypatch.chdir(tmp_path)
    model = compiled(
        "<mujoco><worldbody><body><freejoint/><geom size='.1'/></body></worldbody></mujoco>"
    )
    data = mujoco.MjData(model)
    data.qpos[0] = np.nan
    before = mujoco.MjLogConfig.get().logto_file
    with unlogged():
        mujoco.mj_step(model, data)
    assert data.warning.number.sum() > 0
    assert not list(tmp_path.iterdir())
    assert mujoco.MjLogConfig.get().logto_file == before


@pytest.mark.parametrize(
    ("jacobian", "solver", "joints", "is_wrong"),
    [
        ("sparse", "Newton", 1, True),
        ("auto", "Newton", 60, True),
        ("auto", "Newton", 59, False),
        ("dense", "Newton", 60, False),
        ("sparse", "CG", 1, False),
    ],
)
def test_the_newton_solver_is_refused_where_its_factor_is_wrong(
    monkeypatch, jacobian, solver, joints, is_wrong
):
    """In one version of MuJoCo sparse Jacobians, which `auto` gives large models, are wrong."""
    body = "<body><joint/><geom size='.1'/></body>" * joints
    option = f"<option jacobian='{jacobian}' solver='{solver}'/>"
    scene = f"<mujoco>{option}<worldbody>{body}</worldbody></mujoco>"
    monkeypatch.setattr(stepping, "WRONG_FACTOR", "none")
    assert compiled(scene).nv == joints
    monkeypatch.setattr(stepping, "WRONG_FACTOR", mujoco.mj_versionString())
    if is_wrong:
        with pytest.raises(gc.InputError, match="set jacobian to dense"):
            compiled(scene)
    else:
        assert compiled(scene).nv == joints
