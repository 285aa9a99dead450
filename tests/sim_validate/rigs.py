"""Grasps on the bench, as several tests need them."""

from dataclasses import replace
from functools import cache

import numpy as np
from scipy.spatial.transform import Rotation

import grasp_core as gc
import scenes
from grasp_core.closure.contacts import contact_frictions
from grasp_core.planning.given_contacts import Seated, grasp_of
from grasp_core.quality.wrench_limits import WrenchBody, limit_of
from sim_validate.engine.rig import squeezed
from sim_validate.engine.schedules import TrialLoad
from sim_validate.engine.setup import Setup
from sim_validate.engine.stepping import Bench

MAX_FORCE = 10.0


@cache
def grasps(name, friction, limit, families=("concurrent",), cones="normal"):
    body = scenes.example_object(name)
    return body, gc.plan(
        body, friction, limit=limit, families=families, settings=gc.PlanSettings(cones=cones)
    ).grasps


def saved_plan(folder, limit=1, friction=0.5):
    """The path of a grasps.json of the wedge."""
    body = scenes.example_object("wedge")
    plan = gc.plan(body, friction, families=("concurrent",), limit=limit)
    return gc.save_grasps(folder / "grasps.json", plan)


@cache
def plan_with_a_bad_grasp():
    """Three grasps, of which the second has a fingertip that meets nothing in simulation.

    It is 10 um from a corner that rounding to eight digits put 7e-9 m below the plane of its face.
    """
    exact = scenes.example_object("dodecahedron")
    turned = Rotation.from_rotvec([5.8, 2.0, 3.0]).apply(exact.vertices - exact.center_of_mass)
    rounded = np.round(0.045 / exact.radius * turned, 8)
    body = gc.Polyhedron.from_mesh(rounded, exact.triangles, name="rounded")
    depths = [
        (body.vertices[((face.polygon[:, None] - body.vertices) ** 2).sum(axis=2).argmin(axis=1)]
         - face.centroid) @ face.normal
        for face in body.faces
    ]  # fmt: skip
    deepest = int(np.argmax([depth.max() for depth in depths]))
    face = body.faces[deepest]
    corner = face.polygon[depths[deepest].argmax()]
    inwards = (face.centroid - corner) / np.linalg.norm(face.centroid - corner)
    plan = gc.plan(body, 1.0, limit=20)
    good = [grasp for grasp in plan if deepest not in grasp.faces][:2]
    moved = next(grasp for grasp in plan if deepest in grasp.faces)
    contacts = list(moved.contacts)
    contacts[moved.faces.index(deepest)] = gc.Contact(corner + 1e-5 * inwards, face.normal)
    bad = grasp_of(Seated(body, moved.faces, tuple(contacts)), 1.0, "bad")
    return replace(plan, grasps=(good[0], bad, good[1]))


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
    return [TrialLoad(limit.limit * limit.wrench, limit.forces) for limit in found]


def imbalance(load, body, grasp):
    """What is left of a wrench and the forces planned for it, in largest normal forces."""
    arms = grasp.positions - body.center_of_mass
    force = load.forces.sum(axis=0) + load.wrench[:3]
    torque = np.cross(arms, load.forces).sum(axis=0) + load.wrench[3:]
    return max(np.abs(force).max(), np.abs(torque).max() / body.radius) / MAX_FORCE
