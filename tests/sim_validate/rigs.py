"""Grasps on the bench, as several tests need them."""

from functools import cache

import numpy as np

import grasp_core as gc
import scenes
from grasp_core.closure.contacts import contact_frictions
from grasp_core.quality.wrench_limits import WrenchBody, limit_of
from sim_validate.engine.limits_and_friction import squeezed
from sim_validate.engine.setup import Setup
from sim_validate.engine.simulate import Bench, Load

MAX_FORCE = 10.0


@cache
def grasps(name, friction, limit, families=("concurrent",), cones="normal"):
    body = scenes.example_object(name)
    return body, gc.plan(body, friction, limit=limit, families=families, cones=cones).grasps


def saved_plan(folder, limit=1, friction=0.5):
    """The path of a grasps.json of the wedge."""
    body = scenes.example_object("wedge")
    plan = gc.plan(body, friction, families=("concurrent",), limit=limit)
    return gc.save_grasps(folder / "grasps.json", plan)


def rig_of(body, grasp, friction):
    """The object in the gentle grasp of its scene."""
    setup = Setup(surface="pads")
    scene = setup.scene(body, grasp, friction)
    forces = np.einsum("kij,kj->ki", scene.layout.frames, scene.layout.squeeze)
    return squeezed(Bench(scene, threads=setup.threads), setup, forces, friction)


def limiting_loads(body, grasp, friction, count, seed=0):
    """Random wrenches with torques at their predicted limits, and the forces that balance them."""
    arms = grasp.positions - body.center_of_mass
    resisted = WrenchBody(
        arms, grasp.normals, contact_frictions(friction, len(grasp.contacts)), MAX_FORCE
    )
    scale = np.array([1.0] * 3 + [body.radius] * 3)
    drawn = np.random.default_rng(seed).normal(size=(count, 6)) * scale
    found = [limit_of(resisted, wrench) for wrench in drawn]
    return [Load(limit.limit * limit.wrench, limit.forces) for limit in found]


def imbalance(load, body, grasp):
    """What is left of a wrench and the forces planned for it, in largest normal forces."""
    arms = grasp.positions - body.center_of_mass
    force = load.forces.sum(axis=0) + load.wrench[:3]
    torque = np.cross(arms, load.forces).sum(axis=0) + load.wrench[3:]
    return max(np.abs(force).max(), np.abs(torque).max() / body.radius) / MAX_FORCE
