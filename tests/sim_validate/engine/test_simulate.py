import math
from dataclasses import replace

import mujoco
import numpy as np
import pytest

import grasp_core as gc
import scenes
from grasp_core.arrays import to_digits
from sim_validate.engine.bench import CHUNK, Bench, Load
from sim_validate.engine.rig import part, squeezed
from sim_validate.engine.setup import Setup
from sim_validate.engine.traces import Outcome, judge
from sim_validate.settings import HoldProtocol
from tests.sim_validate.rigs import grasps, limiting_loads, rig_of

BLOW_UP = np.full(6, 1e14)


@pytest.fixture(scope="module")
def held():
    body, (grasp, *_) = grasps("random-12-1", 0.5, 1)
    return body, grasp, rig_of(body, grasp, 0.5)


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
        mujoco.mj_step(model, data, nstep=CHUNK)
        rows.append(data.qpos.copy())
    return np.array(rows)


@pytest.mark.parametrize("threads", [1, 2, 3])
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


def test_friction_is_that_of_the_schedule_and_not_of_the_scene(held):
    """The same forces, balanced at rest, slip at a friction far below what they need."""
    body, grasp, _ = held
    rig = rig_of(body, grasp, 0.5)
    (limit,) = limiting_loads(body, grasp, 0.5, 1)
    load = part(rig.idle, limit, 0.97)
    outcomes = []
    for friction in (0.5, 0.4):
        (trial,) = replace(rig, friction=friction).holds([load], [1.5])
        (motion,) = rig.bench.simulated([trial.told(rig.bench.scene.layout)], rig.closed.state)
        outcomes.append(np.abs(motion.joints[-1, :3] - motion.joints[trial.watched - 1, :3]).max())
    assert outcomes[0] < 1e-7
    assert outcomes[1] > 1e-4


def test_a_blow_up_is_reported_and_not_reset(held):
    _, _, rig = held
    (found,) = rig.hold([Load(BLOW_UP, rig.idle.forces)])
    layout = rig.bench.scene.layout
    assert judge(found, layout, HoldProtocol()).outcome is Outcome.DIVERGED
    assert abs(found.health.clock_error_s) < 1e-9


def test_a_good_hold_beside_a_blow_up_is_judged_on_its_own(held):
    _, _, rig = held
    still = Load(np.zeros(6), rig.idle.forces)
    layout = rig.bench.scene.layout
    together = rig.hold([still, Load(BLOW_UP, rig.idle.forces), still])
    outcomes = [judge(found, layout, HoldProtocol()).outcome for found in together]
    assert outcomes == [Outcome.HELD, Outcome.DIVERGED, Outcome.HELD]
    (alone,) = rig.hold([still])
    np.testing.assert_array_equal(alone.displacements_m, together[2].displacements_m)


def test_trials_past_their_time_are_stopped_and_say_so(held):
    body, grasp, _ = held
    bench = Bench(scenes.build_scene(body, grasp, 0.5), timeout_s=0.0)
    told = [trials_of(held)[0].told(bench.scene.layout)]
    (motion,) = bench.simulated(told)
    assert motion.health.timed_out
    assert len(motion.joints) == 0
    assert motion.health.error == ""
    assert not Bench(bench.scene).simulated(told)[0].health.timed_out


def test_a_long_grasp_stays_where_it_is_while_it_is_squeezed():
    """Contacts 16 cm apart with a lever of 1 cm: a jerk would turn the object at once."""
    friction = math.tan(math.radians(10.0))
    body = scenes.example_object("screwdriver")
    positions = [
        [-0.0063431, 0.0127652, -0.0760739], [0.0063431, -0.0127652, -0.0760739],
        [-0.0065395, 0.0011148, 0.0815116], [0.0065395, -0.0011148, 0.0815116],
    ]  # fmt: skip
    normals = [
        min(body.faces, key=lambda face, at=at: _distance(face, at)).normal for at in positions
    ]
    contacts = [gc.Contact(at, n) for at, n in zip(positions, normals, strict=True)]
    scene = scenes.build_scene(body, contacts, friction)
    forces = 10.0 * gc.force_closure(positions, normals, friction).forces
    rig = squeezed(Bench(scene), Setup(), forces, friction)
    (found,) = rig.hold([Load(np.zeros(6), forces)])
    assert found.start_m < 0.2 * HoldProtocol().total_threshold * scene.layout.grasp_size_m


def _distance(face, point):
    """How far a point is from the middle of a face's pieces, if near its plane."""
    off = abs(face.normal @ (np.array(point) - face.centroid))
    return off + 0.01 * np.linalg.norm(np.array(point) - face.centroid)
