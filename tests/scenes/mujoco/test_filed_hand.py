"""A hand that is written anew beside MuJoCo's own model of its file."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

import grasp_core as gc
from scenes.example_objects import example_object
from scenes.hand_files.model import compiled_hand
from scenes.hand_files.model_text import model_text
from scenes.mujoco.chains import Weld
from scenes.mujoco.filed_hand import FiledHand
from scenes.mujoco.published_tests import TestedObject
from scenes.mujoco_options import PhysicsSettings
from tests.scenes.mujoco.compiled import compiled

RUBBING = (0.5, 0.0, 0.0)
PHYSICS = PhysicsSettings(multiccd=False)
"""With several contacts of two shapes, normals of meshes depend on their last digits."""
FREE = "<freejoint/>"
TURNS = "".join(
    f'<joint name="hand:WRJ{kind[0]}{axis}" type="{name}" axis="{way}"/>'
    for kind, name in (("Translation", "slide"), ("Rotation", "hinge"))
    for axis, way in (("x", "1 0 0"), ("y", "0 1 0"), ("z", "0 0 1"))
)
FOUR = "-.01 -.01 -.02 .02 -.01 -.01 0 .02 -.01 0 0 .03"
HAND = """
<mujoco><compiler angle="radian"/><asset><mesh name="four" vertex="{FOUR}"/></asset><worldbody>
{before}<body name="palm" pos=".01 .02 .03" quat=".9 .1 .3 -.2">{joints}
  <geom type="box" size=".03 .04 .01"/><geom type="sphere" size=".2" contype="0" conaffinity="0"/>
  <body name="plate" pos="0 .05 .02"><geom type="cylinder" size=".02 .01"/></body>
  <body name="a0" pos=".03 .02 .02" euler=".2 .3 .1">
    <joint name="a0" axis="0 1 .2" pos=".001 0 .002" ref=".3" range="-1.2 1.6" damping=".02"
      armature="1e-4" frictionloss=".01" stiffness=".3" springref=".2"/>
    <geom type="capsule" size=".008" fromto="0 0 0 0 0 .04"/>
    <body name="knob" pos="-.02 0 .01"><geom type="ellipsoid" size=".02 .012 .01"/></body>
    <body name="a1" pos="0 0 .05"><joint name="a1" type="slide" axis="-1 0 0" range="0 .04"
      solreflimit=".01 .9" solimplimit=".8 .9 .002 .4 3" damping="2"/>
      <geom type="mesh" mesh="four" euler=".1 .2 .3"/>
      <body name="a2" pos="0 0 .03"><joint name="a2" axis="1 1 0" range="-2 2" margin=".01"/>
        <geom name="tip a" type="sphere" size=".012" pos="-.01 0 .02"/></body></body></body>
  <body name="b0" pos="-.03 .02 .02"><joint name="b0" axis="0 -1 0" range="-1.2 1.6"/>
    <geom name="link b" type="box" size=".008 .02 .02" pos="0 0 .02" contype="2" conaffinity="4"/>
    <body name="b1" pos="0 0 .05"><joint name="b1" axis="0 -1 0"/>
      <inertial pos="0 .01 .02" mass=".03" fullinertia="3e-5 4e-5 5e-5 1e-6 2e-6 -1e-6"/>
      <geom type="capsule" size=".01" fromto="0 0 0 .03 0 .04" contype="4" conaffinity="3"/>
    </body></body>
  <body name="c0" pos="0 -.03 .02"><joint name="c0" axis="1 0 0"/>
    <geom type="mesh" mesh="four" pos="0 0 .03"/>
    <body name="c1" pos="0 0 .04"><joint name="c1" axis="1 0 0" actuatorfrcrange="-.2 .1"/>
      <geom type="capsule" size=".01" fromto="0 0 0 0 .03 .03"/></body></body>
</body>{after}</worldbody>
<contact><exclude body1="knob" body2="c1"/><exclude body1="{world}" body2="c1"/>
  <pair geom1="tip a" geom2="link b"/></contact>
<equality><joint joint1="b1" joint2="b0" polycoef=".1 .5 .2 0 0" solref=".03 .8"/>
  <joint joint1="c0" joint2="a0" polycoef=".2 -.5 0 0 0" active="false"/></equality>
<actuator>
  <position joint="a0" kp="3" kv=".1" gear="-2" ctrlrange="-1 2" forcerange="-1 1"/>
  <position joint="a1" kp="200"/>
  <general joint="a2" gainprm="4" biastype="affine" biasprm="0 -4 -.3"/>
  <general joint="b0" gainprm="4" biastype="affine" biasprm=".1 -4 0"/>
  <motor joint="c0" gear="3" forcerange="-.1 .1"/>
</actuator></mujoco>"""
"""A hand of which a part is at rest in its world, with every rule that a file may have."""
OWN_SERVOS = {"a0": -2.0, "a1": 1.0, "a2": 1.0}
"""Gears of the servos that go to a position."""
JOINTS = ("a0", "a1", "a2", "b0", "b1", "c0", "c1")
STATED = 1.5


def filed(folder, text, **options):
    path = folder / "hand.xml"
    path.write_text(text)
    return FiledHand.of(compiled_hand(model_text(path)), RUBBING, STATED, **options)


def text_with(joints, before="", after="", world="world"):
    return HAND.format(joints=joints, before=before, after=after, world=world, FOUR=FOUR)


BASE = '<geom type="box" size=".03 .04 .01" pos="0 0 .01"/>'
ROOTS = {
    "free": (text_with(FREE), text_with(FREE)),
    "turned": (text_with(TURNS), text_with(TURNS)),
    "fixed": (
        text_with("", BASE), text_with("", f'<body name="root">{FREE}{BASE}', "</body>", "root"),
    ),
}  # fmt: skip
"""What moves the root: the text of the file, and that of a model whose root moves."""


@pytest.fixture(scope="module")
def held():
    return TestedObject(example_object("wedge"), 0.5, 0.1, PHYSICS)


@pytest.fixture(params=ROOTS)
def texts(request):
    return ROOTS[request.param]


def both_models(texts, held, folder, **options):
    """MuJoCo's model of the file with the options of the scene, and that of the scene."""
    hand = filed(folder, texts[0], **options)
    ours, _ = compiled(held.by_filed_hand(hand))
    theirs = mujoco.MjModel.from_xml_string(texts[1])
    for each in (ours, theirs):
        each.opt.ccd_iterations, each.opt.ccd_tolerance = 500, 1e-12
    for name in ("disableflags", "enableflags", "timestep", "impratio"):
        setattr(theirs.opt, name, getattr(ours.opt, name))
    theirs.opt.gravity[:] = 0.0
    return hand, ours, theirs


def placed(model, angles, prefix=""):
    data = mujoco.MjData(model)
    for name, angle in angles.items():
        data.joint(prefix + name).qpos[0] = angle
    return data


def random_angles(rng):
    return dict(
        zip(JOINTS, rng.uniform(-1.0, 1.0, len(JOINTS)) * [1.6, 0.05, 2, 2, 2, 2, 2], strict=True)
    )


def own_contacts(model, data, prefix=""):
    """Pairs of links that touch, and the least distance of each."""
    mujoco.mj_kinematics(model, data)
    mujoco.mj_collision(model, data)
    found = {}
    for geoms, distance in zip(data.contact.geom, data.contact.dist, strict=True):
        names = [model.body(int(model.geom_bodyid[geom])).name for geom in geoms]
        if "object" not in names:
            key = frozenset(
                "root" if name in {"world", "root"} else name
                for name in (name.removeprefix(prefix) for name in names)
            )
            found[key] = min(distance, found.get(key, np.inf))
    return found


@pytest.mark.parametrize("weld", [None, Weld()])
def test_links_stand_and_touch_each_other_as_in_the_file(texts, weld, held, tmp_path):
    _, ours, theirs = both_models(texts, held, tmp_path, weld=weld)
    rng, seen = np.random.default_rng(0), set()
    for _ in range(200):
        angles = random_angles(rng)
        own, their = placed(ours, angles, "hand/"), placed(theirs, angles)
        touching = own_contacts(ours, own, "hand/")
        assert touching == pytest.approx(own_contacts(theirs, their), abs=1e-7)
        seen |= set(touching)
        for body in range(1, theirs.nbody):
            if (name := theirs.body(body).name) != "root":
                np.testing.assert_allclose(
                    own.body(f"hand/{name}").xpos, their.xpos[body], atol=1e-9
                )
                np.testing.assert_allclose(
                    own.body(f"hand/{name}").xmat, their.xmat[body], atol=1e-9
                )
    assert len(seen) > 10
    assert frozenset({"a2", "b0"}) in seen  # an explicit pair
    assert (
        not {frozenset({"knob", "c1"}), frozenset({"root", "c1"}), frozenset({"palm", "knob"})}
        & seen
    )


def test_the_root_carries_the_hand(texts, held, tmp_path):
    hand, ours, theirs = both_models(texts, held, tmp_path)
    angles = random_angles(np.random.default_rng(1))
    own, their = placed(ours, angles, "hand/"), placed(theirs, angles)
    own.mocap_pos[0], own.mocap_quat[0] = (
        (0.1, 0.2, 0.3),
        np.array([1.0, 2.0, -3.0, 4.0]) / np.sqrt(30.0),
    )
    mujoco.mj_kinematics(ours, own)
    mujoco.mj_kinematics(theirs, their)
    turn = own.body("hand/world").xmat.reshape(3, 3)
    expected = own.mocap_pos[0] + turn @ their.body("a2").xpos
    np.testing.assert_allclose(own.body("hand/a2").xpos, expected, atol=1e-9)
    assert hand.joint_names == JOINTS


def test_joints_move_as_in_the_file(texts, held, tmp_path):
    """Masses, inertias, armatures, dampers, springs, stops, friction, couplings and servos."""
    hand, ours, theirs = both_models(texts, held, tmp_path)
    rng = np.random.default_rng(2)
    for each in (ours, theirs):
        each.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    for _ in range(20):
        angles, speeds, told = random_angles(rng), rng.normal(size=7), 2.0 * rng.normal(size=7)
        own, their = placed(ours, angles, "hand/"), placed(theirs, angles)
        columns = {}
        for data, prefix in ((own, "hand/"), (their, "")):
            places = [int(data.joint(prefix + name).id) for name in JOINTS]
            model = data.model
            columns[prefix] = model.jnt_dofadr[places]
            data.qvel[columns[prefix]] = speeds
        own.ctrl[:] = hand.servos.pulls @ told
        for i in range(theirs.nu):
            name = theirs.joint(int(theirs.actuator_trnid[i, 0])).name
            their.ctrl[i] = OWN_SERVOS.get(name, 0.0) * told[JOINTS.index(name)]
        mujoco.mj_forward(ours, own)
        mujoco.mj_forward(theirs, their)
        rows = [columns["hand/"], columns[""]]
        masses = []
        for model, data, at in zip((ours, theirs), (own, their), rows, strict=True):
            whole = np.zeros((model.nv, model.nv))
            mujoco.mj_fullM(model, data, whole)
            masses.append(whole[np.ix_(at, at)])
        np.testing.assert_allclose(*masses, atol=1e-12)
        np.testing.assert_allclose(
            own.qfrc_passive[rows[0]], their.qfrc_passive[rows[1]], atol=1e-12
        )
        driven = [JOINTS.index(name) for name in OWN_SERVOS]
        np.testing.assert_allclose(
            own.qfrc_actuator[rows[0]][driven], their.qfrc_actuator[rows[1]][driven], atol=1e-9
        )
        for name in ("efc_type", "efc_pos", "efc_KBIP", "efc_frictionloss"):
            np.testing.assert_allclose(getattr(own, name), getattr(their, name), atol=1e-9)
        assert own.qfrc_actuator[rows[0][JOINTS.index("b1")]] == 0.0  # it follows b0
        for name in ("b0", "c0", "c1"):
            place = JOINTS.index(name)
            limit = {"c0": 0.3, "c1": 0.2}.get(name, np.inf)
            settling = 0.02 * STATED
            expected = STATED * (told[place] - angles[name]) - settling * speeds[place]
            assert own.qfrc_actuator[rows[0][place]] == pytest.approx(
                np.clip(expected, -limit, limit)
            )
    assert np.isfinite(hand.servos.spans).all(axis=1).tolist() == [True] + [False] * 5
    assert hand.servos.names == ("a0", "a1", "a2", "b0", "c0", "c1")


def test_servos_may_be_the_stated_ones_and_stops_and_touching_itself_left_out(held, tmp_path):
    hand = filed(tmp_path, ROOTS["free"][0], own_servos=False)
    every = np.array([1.0, 400.0, 1.0, 1.0, 1.0, 1.0, 1.0])  # the slide is as one 5 cm from it
    hinge = np.delete(every, JOINTS.index("b1"))  # which follows another
    np.testing.assert_allclose(hand.servos.stiffness, STATED * hinge)
    alike = hand.servos.alike(3.0, 0.2)
    np.testing.assert_allclose(alike.stiffness, 3.0 * hinge)
    np.testing.assert_allclose(alike.damping, 0.2 * hinge)
    np.testing.assert_allclose(alike.damped(0.03).damping, 0.6 * hinge)
    assert np.isinf(hand.servos.spans).all()
    np.testing.assert_allclose(hand.servos.limits, [2.0, *[np.inf] * 3, 0.3, 0.2])
    rng = np.random.default_rng(0)
    alone, _ = compiled(held.by_filed_hand(replace(hand, meets_itself=False)))
    free, _ = compiled(held.by_filed_hand(replace(hand, stops=False, armature_kg_m2=2e-3)))
    kept, _ = compiled(held.by_filed_hand(hand))
    for _ in range(50):
        assert not own_contacts(alone, placed(alone, random_angles(rng), "hand/"))
    assert not free.jnt_limited.any()
    np.testing.assert_allclose(free.dof_armature[6:] - kept.dof_armature[6:], 2e-3 * every)


PULLED = HAND.replace(
    "<actuator>",
    """<tendon><fixed name="pull"><joint joint="c0" coef="2"/><joint joint="c1" coef="-.5"/></fixed>
  <fixed name="hold"><joint joint="a2" coef="1"/><joint joint="a0" coef=".5"/></fixed></tendon>
<actuator><position tendon="pull" kp="5" kv=".2" gear="2" forcerange="-.3 .2"/>""",
).replace('<motor joint="c0" gear="3" forcerange="-.1 .1"/>', "").replace(
    "</equality>", '<tendon tendon1="hold" polycoef=".1 0 0 0 0"/></equality>'
)  # fmt: skip


def test_tendons_pull_and_tie_joints_as_in_the_file(held, tmp_path):
    """Torques of a motor that pulls two joints, and angles that a tendon of one length leaves."""
    text = PULLED.format(joints=FREE, before="", after="", world="world", FOUR=FOUR)
    hand, ours, theirs = both_models((text, text), held, tmp_path)
    assert hand.servos.names == ("a0", "a1", "b0", "pull")
    assert hand.servos.limits[-1] == pytest.approx(0.6)
    rng = np.random.default_rng(3)
    for _ in range(20):
        angles, told = random_angles(rng), 0.3 * rng.normal(size=7)
        own, their = placed(ours, angles, "hand/"), placed(theirs, angles)
        own.ctrl[:] = hand.servos.pulls @ told
        length = hand.servos.pulls[-1] @ told
        their.ctrl[[theirs.actuator(i).name for i in range(theirs.nu)].index("")] = 2.0 * length
        for model, data in ((ours, own), (theirs, their)):
            mujoco.mj_forward(model, data)
        for name in ("c0", "c1"):
            ends = [data.joint(prefix + name).qfrc_actuator[0]
                    for data, prefix in ((own, "hand/"), (their, ""))]  # fmt: skip
            assert np.abs(ends[0]) > 0.0
            if np.abs(own.actuator_force[-1]) < 0.39:  # theirs has other limits either way
                assert ends[0] == pytest.approx(ends[1], abs=1e-9)
        obeyed, _ = hand.following(np.array([angles[name] for name in JOINTS]))
        a0, _, a2, b0, b1, *_ = obeyed
        assert a2 + 0.5 * a0 == pytest.approx(0.5 * 0.3 + 0.1)  # c0 is drawn at .3
        assert b1 == pytest.approx(0.1 + 0.5 * b0 + 0.2 * b0**2)


def test_torques_of_motors_are_those_of_virtual_work(tmp_path):
    """A motor's torque times its turn is the work of contact forces on joints that obey rules."""
    text = PULLED.format(joints=FREE, before="", after="", world="world", FOUR=FOUR)
    hand, rng = filed(tmp_path, text), np.random.default_rng(4)
    angles, levers, small = rng.uniform(-1.0, 1.0, 7), rng.normal(size=(7, 6)), 1e-6
    obeyed, turning = hand.following(angles)
    for column, free in enumerate(("a0", "a1", "b0", "c0", "c1")):
        moved = obeyed.copy()
        moved[JOINTS.index(free)] += small
        assert hand.following(moved)[0] - obeyed == pytest.approx(
            small * turning[:, column], abs=1e-10
        )
    motors = hand.motors(levers, obeyed, 7.0)
    assert motors.limits == pytest.approx([2.0, 7.0, 7.0, 0.6, 1e-6])
    work = turning.T @ levers  # of the free joints, per contact force
    pulled = hand.servos.pulls @ turning
    # forces that leave the pulled joints in balance are borne by the motors alone
    free = np.linalg.svd(motors.levers[4:])[2][1:].T
    assert pulled.T @ motors.levers[:4] @ free == pytest.approx(work @ free)
    assert np.abs(pulled.T @ motors.levers[:4] - work).max() > 0.1


def test_every_shape_that_collides_may_touch_the_object_and_no_other(held, tmp_path):
    model, _ = compiled(held.by_filed_hand(filed(tmp_path, ROOTS["fixed"][0])))
    body = model.body("object").id
    (solid,) = (
        geom for geom in range(model.ngeom)
        if model.geom_bodyid[geom] == body and model.geom_contype[geom]
    )  # fmt: skip
    own = np.flatnonzero(model.geom_bodyid != body)
    kinds = [mujoco.mjtGeom(int(kind)).name[7:].lower() for kind in model.geom_type[own]]
    expected = {"box": 3, "mesh": 2, "capsule": 3, "cylinder": 1, "ellipsoid": 1, "sphere": 1}
    assert {kind: kinds.count(kind) for kind in kinds} == expected
    assert (model.geom_conaffinity[own] & model.geom_contype[solid]).all()
    assert (model.geom_friction[own] == RUBBING).all()


def test_a_root_without_a_mass_of_its_own_hangs_on_a_weld(held, tmp_path):
    text = """<mujoco><worldbody><geom type="box" size=".03 .03 .01"/>
    <body name="left" pos="-.02 0 .01"><joint axis="1 0 0" type="slide"/><geom size=".01"/></body>
    <body name="right" pos=".02 0 .01"><joint axis="1 0 0" type="slide"/><geom size=".01"/></body>
    </worldbody></mujoco>"""
    hand = filed(tmp_path, text, weld=Weld())
    model, _ = compiled(held.by_filed_hand(hand))
    assert model.body("root").subtreemass[0] == pytest.approx(0.3 + 2 * 4 / 3 * np.pi * 1e-3)
    assert hand.joint_names == ("joint0", "joint1")
    assert hand.lever_m == 0.05
    assert hand.fingers == (("hand/left",), ("hand/right",))


def test_fingers_are_the_branches_behind_the_palm(tmp_path):
    text = """<mujoco><default><geom size=".01"/><joint axis="1 0 0"/></default><worldbody>
    <body name="arm"><joint axis="0 0 1"/><geom/>
    <body name="palm"><geom/><joint/><body name="badge"><geom/></body>
      <body name="a"><body name="a0"><joint/><geom/>
        <body name="a1" pos="0 0 .05"><joint name="a1"/><geom/></body></body></body>
      <body name="b0" pos="0 .1 0"><joint name="b0"/><geom/><body name="b1"><geom/></body></body>
    </body></body></worldbody></mujoco>"""
    hand = filed(tmp_path, text)
    assert hand.fingers == (
        ("hand/a", "hand/a0", "hand/a1"), ("hand/b0", "hand/b1"),
    )  # fmt: skip
    assert [hand.joints_of(finger) for finger in (0, 1)] == [[2, 3], [4]]
    rule = '<equality><joint joint1="b0" joint2="a1"/></equality></mujoco>'
    tied = filed(tmp_path, text.replace("</mujoco>", rule))
    assert [tied.joints_of(finger) for finger in (0, 1)] == [[2, 3, 4], [3, 4]]
    alone = filed(
        tmp_path, text.split('<body name="b0"')[0] + "</body></body></worldbody></mujoco>"
    )
    assert alone.fingers == (("hand/a1",),)
    # the arm and the palm move a1 and b by 5 and 10 cm, and a0 moves a1
    squares = 2 * (2 * 0.1**2 + 0.05**2) + 0.05**2
    assert hand.lever_m == pytest.approx(np.sqrt(squares / (8 + 7 + 2 + 1 + 2)))


BALL = '<body><joint name="ball" type="ball"/><geom size=".01"/></body>'
HINGE = '<body><joint name="hinge" axis="1 0 0"/><geom size=".01"/></body>'
CUBE = '<body><freejoint name="cube"/><geom size=".01"/></body>'


@pytest.mark.parametrize(
    ("bodies", "said"),
    [
        (CUBE, "must have joints that move its links, got none"),
        (BALL, "joint ball must be a hinge or a slide, got ball"),
        (HINGE + CUBE, "joint cube must move the whole hand, but does not move hinge"),
    ],
)
def test_what_is_no_hand_is_refused(bodies, said, tmp_path):
    with pytest.raises(gc.InputError, match=said):
        filed(tmp_path, f"<mujoco><worldbody>{bodies}</worldbody></mujoco>")
