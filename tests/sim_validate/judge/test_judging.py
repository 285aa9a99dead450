"""Records are judged as they say: by their own squeeze, in their own world, with proofs."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

import grasp_core as gc
from grasp_core.closure.critical_friction import critical_friction
from grasp_core.errors import InputError
from sim_validate.judge import judging
from sim_validate.protocols.judging import PUBLISHED_STEPS, their_verdict, timeline
from sim_validate.protocols.published import protocol
from sim_validate.protocols.settings import JudgeSettings
from tests.sim_validate.judge.allegro import bent, lifted, record, stage, with_open_finger

TEST = protocol("dexgraspbench")
TESTED = JudgeSettings(tests=("dexgraspbench",), trial=False)


def judged(*records, settings=TESTED):
    return stage(settings).judged(records)


def test_a_record_is_judged_by_its_own_squeeze():
    """A record whose squeeze opens the hand lets go; its contacts are as closed as before."""
    opening = replace(record(), squeeze=record().pregrasp)
    usual, other = judged(record(), opening)
    assert usual.passed, [run.reason for run in usual.tests[0].runs]
    assert usual.closed
    assert len(usual.tests[0].runs) == 6
    assert not other.passed
    assert other.proof == usual.proof


def test_the_proof_is_of_the_links_that_touch():
    (found,) = judged(record())
    assert found.proof.verify()
    assert len(found.proof.positions) == len(found.links) >= 4
    assert {link.split("_")[0] for link in found.links} >= {"first", "middle", "ring", "thumb"}
    assert found.critical_friction == critical_friction(found.proof.positions, found.proof.normals)
    assert 0.0 < found.critical_friction < 0.5
    assert found.ferrari_canny > 0.0
    # a weight is held in every orientation, so a force along each axis is, too
    assert found.payload > 0.0
    assert found.least_push_n == pytest.approx(0.1 * 9.80665 / found.payload, rel=1e-3)
    assert found.weakest_n > 0.0


def test_a_hand_away_from_the_object_has_no_contact_and_no_proof():
    (found,) = judged(lifted(0.5))
    assert (found.proof, found.links, found.depth_m, found.passed) == (None, (), 0.0, False)
    assert "0 contacts" in found.undecided
    assert found.critical_friction is None


def test_slippery_contacts_are_proved_open_with_a_wrench_that_nothing_resists():
    settings = JudgeSettings(friction=1e-3, tests=("dexgraspbench",), trial=False)
    (found,) = judged(record(), settings=settings)
    assert found.closed is False
    assert found.proof.verify()
    (test,) = found.tests
    assert test.closed  # at the friction of the test, which is another
    assert test.passed
    assert (found.ferrari_canny, found.payload, found.weakest_n) == (0.0, 0.0, 0.0)
    # no contact can do work on the motion that separates them
    points, normals, y = found.proof.positions, found.proof.normals, found.proof.separating_wrench
    rng = np.random.default_rng(0)
    for _ in range(200):
        across = rng.normal(size=normals.shape)
        across -= np.einsum("ki,ki->k", across, normals)[:, None] * normals
        across *= 1e-3 / np.linalg.norm(across, axis=1)[:, None]
        for point, force in zip(points, normals + across, strict=True):
            assert np.concatenate([force, np.cross(point, force)]) @ y <= 1e-9


def test_a_hand_that_stands_too_deep_before_it_closes_is_not_tested():
    deep = lifted(-0.03)
    (found,) = judged(deep)
    (run,) = found.tests[0].runs
    assert not run.passed
    assert "before it closes the hand stands" in run.reason


def test_records_of_another_hand_are_told_apart_and_the_others_judged():
    fewer = replace(record(), id="fewer", pregrasp=None, squeeze=None,
                    grasp=bent(record().grasp, record().grasp.joints[:5]))  # fmt: skip
    found = judged(fewer, record())
    assert found[0] == (
        "the record must have the 16 joints of the hand, got 5; complete it, or give the hand that "
        "was recorded"
    )
    assert found[1].passed


def test_a_record_is_judged_alike_alone_and_with_others():
    alone, together = judged(with_open_finger()), judged(record(), with_open_finger())
    assert alone[0] == together[1]


def scene(one):
    own = stage(TESTED)
    looked = own.looked(one)
    return own.told(TEST, [looked])[0]


def test_forces_are_along_the_axes_of_the_records_world():
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    laid = [timeline(TEST, scene(each), TEST.runs[1])
            for each in (record(), replace(record(), axes=turn.T))]  # fmt: skip
    assert laid[0].wrenches[-1] == pytest.approx([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert laid[1].wrenches[-1] == pytest.approx([0.0, -1.0, 0.0, 0.0, 0.0, 0.0])
    assert laid[1].commands == pytest.approx(laid[0].commands)


def test_a_run_is_what_a_plain_loop_of_steps_gives():
    """An independent driver: the hand on its weld, told by setting the mocap body's pose."""
    made = scene(record())
    run = timeline(TEST, made, TEST.runs[2])
    model = mujoco.MjModel.from_xml_string(made.xml)
    data, farthest = mujoco.MjData(model), 0.0
    data.qpos[7:] = made.opened
    for sample, (told, wrench) in enumerate(zip(run.commands, run.wrenches, strict=True)):
        data.mocap_pos[0], data.mocap_quat[0], data.ctrl[:] = told[:3], told[3:7], told[7:]
        data.xfrc_applied[model.body("object").id] = wrench
        mujoco.mj_step(model, data, nstep=PUBLISHED_STEPS)
        if sample in run.looks:
            farthest = max(farthest, float(np.linalg.norm(data.qpos[:3])))
    assert their_verdict(TEST, made)[2].displacement_m == pytest.approx(farthest, abs=1e-9)


def test_a_test_without_a_name_is_refused():
    with pytest.raises(InputError, match="must be one of dexgraspbench"):
        JudgeSettings(tests=("nobody's",))


def test_two_contacts_at_least_can_be_proved():
    one = gc.Contact(np.zeros(3), np.array([0.0, 0.0, 1.0]))
    assert judging.proved([one], 0.5) == "1 contacts cannot be in force closure"
