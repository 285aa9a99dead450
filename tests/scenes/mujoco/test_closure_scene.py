import mujoco
import numpy as np
import pytest

import grasp_core as gc
import scenes
from scenes.mujoco.closure_scene import GENTLE_SQUEEZE, PAD_TOUCH
from scenes.mujoco.scene_text import TOUCH_DEPTH
from tests.scenes.mujoco.compiled import compiled, state_of

OBJECTS = ("wedge", "screwdriver")
SINGLE = 4e-8
"""Largest error of a mesh's coordinate, which the simulator holds in single precision, in radii."""


@pytest.fixture(params=OBJECTS, scope="module")
def held(request):
    body = scenes.example_object(request.param)
    grasp = gc.plan(body, 0.5, limit=1, settings=gc.PlanSettings(cones="normal")).grasps[0]
    scene = scenes.build_scene(body, grasp, 0.5)
    return body, grasp, scene, compiled(scene)[0]


def touching(model, data):
    """The fingertip of each contact, and the normal that points out of it."""
    for contact in data.contact:
        names = [model.geom(int(geom)).name for geom in contact.geom]
        (finger,) = (name for name in names if name.startswith("finger"))
        yield int(finger[6:]), contact.frame[:3] * (1.0 if names[0] == finger else -1.0)


def test_every_setting_reaches_the_compiled_model(held):
    _, _, scene, model = held
    names = {
        "Newton": mujoco.mjtSolver.mjSOL_NEWTON,
        "elliptic": mujoco.mjtCone.mjCONE_ELLIPTIC,
        "dense": mujoco.mjtJacobian.mjJAC_DENSE,
        "discrete": mujoco.mjtIntegrator.mjINT_DISCRETE,
    }
    options = scene.physics.options()
    mujocos = {
        name for name in dir(model.opt) if not name.startswith(("_", "o_", "disable", "enable"))
    }
    assert set(options) == mujocos
    for name, value in options.items():
        expected = int(names[value]) if isinstance(value, str) else value
        np.testing.assert_array_equal(getattr(model.opt, name), expected, err_msg=name)
        assert f'{name}="' in scene.xml
    met = [i for i in range(model.ngeom) if model.geom_contype[i] or model.geom_conaffinity[i]]
    assert len(met) == 4 + len(scene.layout.solids or "m")
    for geom in met:
        np.testing.assert_array_equal(model.geom_solref[geom], scene.physics.solref)
        np.testing.assert_array_equal(model.geom_solimp[geom], scene.physics.solimp)
        assert model.geom_condim[geom] == 3
        assert model.geom_margin[geom] == model.geom_gap[geom] == 0.0
        assert model.geom_friction[geom, 0] == 0.5


def test_fingertips_touch_their_pads_exactly_where_the_grasp_says(held):
    body, grasp, *_ = held
    scene = scenes.build_scene(body, grasp, 0.5, surface="pads")
    model, data = compiled(scene, "grasp")
    for finger, contact in enumerate(grasp.contacts):
        tip = data.geom(f"finger{finger}")
        height = scene.layout.drive.radius_m - PAD_TOUCH * scene.layout.grasp_size_m
        touch = tip.xpos + height * contact.normal
        rounded = 1e-9 * body.radius
        np.testing.assert_allclose(touch, contact.position - body.center_of_mass, atol=rounded)
        pad = data.geom(f"pad{finger}")
        outward = pad.xmat.reshape(3, 3)[:, 2]
        np.testing.assert_allclose(outward, -contact.normal, atol=2e-9)
        np.testing.assert_allclose(outward, -scene.layout.frames[finger, :, 0], atol=1e-14)
        top = pad.xpos + outward * model.geom(f"pad{finger}").size[2]
        tip_top = tip.xpos - height * outward
        assert abs((tip_top - top) @ outward) < 1e-15


@pytest.mark.parametrize("scale", [0.01, 1.0, 20.0])
@pytest.mark.parametrize("name", ["l-bracket", "octahedron"])
def test_all_fingertips_touch_from_the_first_step(name, scale):
    """If they were put exactly onto their faces, rounding would decide which of them do."""
    example = scenes.example_object(name)
    body = gc.Polyhedron.from_mesh(scale * example.vertices, example.triangles, name=name)
    scene = scenes.build_scene(body, gc.plan(body, 0.5, limit=1).grasps[0], 0.5)
    _, data = compiled(scene, "grasp")
    assert data.ncon == 4
    depth, off = TOUCH_DEPTH * body.radius, SINGLE * body.radius
    assert off < 0.5 * depth
    assert all(c.dist == pytest.approx(-depth, abs=off) for c in data.contact)


def test_approach_starts_clear_and_ends_in_a_grasp(held):
    _, _, scene, model = held
    data = state_of(model, "approach")
    assert data.ncon == 0
    mujoco.mj_step(model, data, nstep=1500)
    assert data.ncon == 4
    assert np.linalg.norm(data.qpos[:3]) < 0.02 * scene.layout.radius_m
    assert np.abs(data.qvel).max() < 1e-3


def after(model, key, steps):
    """The state some steps after a keyframe, and the largest push of a fingertip [N]."""
    data = state_of(model, key)
    mujoco.mj_step(model, data, nstep=steps)
    forces = np.zeros((data.ncon, 6))
    for number, force in enumerate(forces):
        mujoco.mj_contactForce(model, data, number, force)
    return data, forces[:, 0].max(initial=0.0)


def test_fingers_push_as_hard_as_their_keyframe_says(held):
    """A servo loses its stiffness times what its finger moves until the contact carries it; and as
    the object turns, a share of the tangential force, at most `friction` of the push, is normal."""
    _, _, scene, model = held
    most = scene.layout.drive.max_normal_force_n
    assert {model.key(i).name for i in range(model.nkey)} == {
        "pregrasp", "approach", "grasp", "squeeze",
    }  # fmt: skip
    for key, share in (("grasp", GENTLE_SQUEEZE), ("squeeze", 1.0)):
        data, push = after(model, key, 1500)
        assert data.ncon == 4
        moved = np.linalg.norm(data.qpos[7:].reshape(4, 3), axis=1).max()
        turned = 2.0 * np.linalg.norm(data.qpos[4:7])
        lost = scene.layout.drive.stiffness_n_per_m * moved + 0.5 * most * turned
        assert lost < 0.05 * most
        assert push == pytest.approx(share * most, abs=lost)
        assert np.linalg.norm(data.qpos[:3]) < 1e-3 * scene.layout.radius_m


def test_a_given_squeeze_is_that_of_the_keyframes(held):
    body, grasp, _, _ = held
    forces = grasp.normals * np.array([1.0, 2.0, 3.0, 4.0])[:, None]
    scene = scenes.build_scene(body, grasp, squeeze=forces)
    model, _ = compiled(scene, "grasp")
    pushes = model.key("grasp").ctrl * scene.layout.holder.servo
    np.testing.assert_allclose(pushes[::3] / pushes[-3], [0.25, 0.5, 0.75, 1.0], rtol=1e-8)
    with pytest.raises(gc.InputError, match="squeeze"):
        scenes.build_scene(body, grasp, squeeze=-forces)
    with pytest.raises(gc.InputError, match="squeeze"):
        scenes.build_scene(body, grasp, squeeze=forces[:2])


def test_the_last_digits_of_contacts_do_not_change_the_text(held):
    """Other machines plan the same contacts with other last digits."""
    body, grasp, scene, _ = held
    rng = np.random.default_rng(0)
    wanted = scene.xml.split("<keyframe>")[0]
    for _ in range(5):
        positions = grasp.positions + 1e-15 * body.radius * rng.normal(size=(4, 3))
        normals = grasp.normals + 1e-16 * rng.normal(size=(4, 3))
        contacts = list(map(gc.Contact, positions, normals))
        assert scenes.build_scene(body, contacts, 0.5).xml.split("<keyframe>")[0] == wanted


def test_each_fingertip_touches_the_face_of_its_contact(held):
    body, grasp, scene, model = held
    assert not scene.layout.on_pads
    assert (scene.layout.solids is None) == (body.name != "screwdriver")
    data = mujoco.MjData(model)
    data.qpos[7::3] += 1e-5
    mujoco.mj_forward(model, data)
    met = list(touching(model, data))
    assert sorted(finger for finger, _ in met) == [0, 1, 2, 3]
    depth = 1e-5 + TOUCH_DEPTH * body.radius
    assert all(c.dist == pytest.approx(-depth, abs=SINGLE * body.radius) for c in data.contact)
    for finger, normal in met:
        assert grasp.contacts[finger].normal @ normal == pytest.approx(1.0, abs=1e-9)


def test_fingertips_touch_pads_where_faces_are_patches():
    """The plane of a patch lies beside the surface, so a fingertip cannot touch it there."""
    example = scenes.example_object("icosahedron")
    body = gc.Polyhedron.from_mesh(example.vertices, example.triangles, faces="patches")
    grasp = gc.plan(body, 0.5, limit=1).grasps[0]
    assert scenes.build_scene(body, grasp, 0.5).layout.on_pads
    assert not scenes.build_scene(body, grasp, 0.5, surface="object").layout.on_pads


def test_rigid_fingertips_have_no_joints_and_stand_where_they_are_put(held):
    body, grasp, scene, _ = held
    fingers = scenes.FingerSettings(drive="rigid", indentation=1e-4)
    rigid = scenes.build_scene(body, grasp, 0.5, fingers=fingers)
    model, data = compiled(rigid)
    assert (model.nv, model.nu, model.nkey) == (6, 0, 0)
    depth = 1e-4 * scene.layout.grasp_size_m
    assert data.ncon == 4
    assert all(c.dist == pytest.approx(-depth, abs=SINGLE * body.radius) for c in data.contact)


def test_coplanar_and_symmetric_contacts_make_scenes_that_load():
    """Moments of inertia of coplanar contacts are the limit of what a body can have."""
    body = scenes.example_object("box")
    for z in (0.0, 0.01):
        contacts = [gc.Contact([s * 0.05, 0.0, z], [-s, 0.0, 0.0]) for s in (1.0, -1.0)] + [
            gc.Contact([0.0, s * 0.035, -z], [0.0, -s, 0.0]) for s in (1.0, -1.0)
        ]
        scene = scenes.build_scene(body, contacts, 0.5)
        model, _ = compiled(scene)
        assert model.body("object").inertia.min() > 0.0
