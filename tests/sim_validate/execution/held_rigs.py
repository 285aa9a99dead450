"""Held objects for tests of executions: grips with answers by hand, their scenes and benches."""

from functools import cache

import numpy as np

import grasp_core as gc
import scenes
from sim_validate.execution import paths
from sim_validate.execution.predictions import HeldDynamics
from sim_validate.execution.simulate import HeldBench
from tests.grasp_core.execution import held
from tests.grasp_core.execution.held import box

MASS = 0.3
G = 9.80665


@cache
def box_grip(push=5.0, friction=0.5, stiffness=2000.0):
    """Four fingers on the faces of a box, opposed along x, with this push each."""
    springs = {"stiffness": stiffness, "tip_radius_m": 0.005}
    return gc.grip(box(), opposed(), friction, held.pressed(push), **springs)


def opposed():
    """Contacts beside the middles of the faces along x."""
    return held.opposed(half=0.5 * np.ptp(box().vertices[:, 0]))


@cache
def box_scene(push=5.0, friction=0.5, stiffness=2000.0, mass=MASS):
    settings = scenes.HeldSettings(mass_kg=mass)
    return scenes.build_held_scene(box(), box_grip(push, friction, stiffness), settings)


@cache
def box_bench(**rig):
    return HeldBench(box_scene(**rig))


@cache
def squeezed(**rig):
    """The simulator's state after the box is squeezed."""
    motion, state = box_bench(**rig).settled(paths.closing())
    assert not motion.health.fault
    return state


def box_dynamics(push=5.0, friction=0.5, stiffness=2000.0, mass=MASS):
    layout = box_scene(push, friction, stiffness, mass).layout
    return HeldDynamics(box_grip(push, friction, stiffness), layout)


@cache
def planned(name, friction=0.5, **chosen):
    body = scenes.example_object(name)
    return body, gc.plan(body, friction, limit=1, **chosen).grasps[0]
