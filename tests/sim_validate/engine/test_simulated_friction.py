import math
from dataclasses import replace

import numpy as np
import pytest

import grasp_core as gc
import scenes
import sim_validate as sv
from scenes.mujoco.closure_scene import build_scene
from sim_validate.engine.rig import Rig
from sim_validate.engine.setup import Setup
from sim_validate.engine.simulated_friction import forces_just_above, released_friction
from sim_validate.engine.stepping import Bench
from sim_validate.settings import FrictionProtocol
from tests.sim_validate.rigs import grasps

FAMILIES = ("concurrent", "pencil", "regulus", "free")


def test_the_simulator_finds_the_critical_friction_of_the_analysis():
    ratios, tiny = [], 0
    for name in ("wedge", "double-wedge-bar"):
        for family in FAMILIES:
            body, found = grasps(name, 0.4, 2, (family,))
            for grasp in found:
                scene = build_scene(body, grasp, 0.4)
                critical = released_friction(
                    Bench(scene), grasp.positions, grasp.normals, grasp.critical_friction, Setup()
                )
                if critical.predicted < FrictionProtocol().least_friction:
                    assert critical.simulated == 0.0
                    tiny += 1
                    continue
                slipped, stayed = critical.bracket
                assert slipped < critical.simulated < stayed
                ratios.append(critical.simulated / critical.predicted)
    assert len(ratios) >= 4
    assert tiny >= 1
    assert np.abs(np.array(ratios) - 1.0).max() < 0.005


@pytest.mark.slow
def test_a_finger_that_hardly_needs_to_push_does_not_let_the_object_turn():
    """Two fingers need the friction; with the others idle the object turned 8 % above it."""
    body = scenes.example_object("box")
    found = gc.plan(body, 2.0, limit=2).grasps
    (grasp,) = [each for each in found if each.id == "c-0-1-2-3"]
    assert sv.simulated_critical_friction(body, grasp) == pytest.approx(
        grasp.critical_friction, rel=0.005
    )
    forces = forces_just_above(grasp.positions, grasp.normals, grasp.critical_friction)
    assert np.einsum("ki,ki->k", forces, grasp.normals).min() > 5e-6


def test_forces_just_above_the_critical_friction_need_it_and_balance():
    body, (grasp, *_) = grasps("random-12-1", 0.5, 1, ("regulus",))
    forces = forces_just_above(grasp.positions, grasp.normals, grasp.critical_friction)
    along = np.einsum("ki,ki->k", forces, grasp.normals)
    across = np.linalg.norm(forces - along[:, None] * grasp.normals, axis=1)
    assert along.max() == pytest.approx(1.0)
    assert (across / along).max() == pytest.approx(grasp.critical_friction, rel=1e-3)
    arms = grasp.positions - body.center_of_mass
    assert np.abs(forces.sum(axis=0)).max() < 1e-7
    assert np.abs(np.cross(arms, forces).sum(axis=0)).max() < 1e-7 * body.radius


@pytest.mark.parametrize(
    ("factor", "found"), [(1.05, True), (0.7, True), (0.6, False), (3.0, False)]
)
def test_a_simulator_with_another_friction_is_seen_through(monkeypatch, factor, found):
    """Friction in the simulation is so many times what it should be: the critical one is less."""
    releases = Rig.releases

    def with_other_friction(rig, high, frictions, *more):
        return releases(rig, high, [factor * friction for friction in frictions], *more)

    body, (grasp, *_) = grasps("random-12-1", 0.5, 1, ("regulus",))
    sv.simulated_critical_friction(body, grasp)  # measures the gate, which is kept
    monkeypatch.setattr(Rig, "releases", with_other_friction)
    simulated = sv.simulated_critical_friction(body, grasp)
    if found:
        assert simulated * factor == pytest.approx(grasp.critical_friction, rel=0.03)
    else:
        assert math.isinf(simulated)


def test_contacts_that_no_friction_closes_are_refused():
    """All four on one face push the same way."""
    body, (grasp, *_) = grasps("wedge", 0.5, 1)
    face = grasp.faces[0]
    corner = body.faces[face].pieces[0][0]
    at = grasp.contacts[0].position
    contacts = tuple(
        gc.Contact(at + 0.1 * i * (corner - at), grasp.contacts[0].normal) for i in range(4)
    )
    bad = replace(grasp, faces=(face,) * 4, contacts=contacts)
    with pytest.raises(gc.InputError, match="no friction gives force closure"):
        sv.simulated_critical_friction(body, bad)
