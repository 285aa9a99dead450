"""Is this simulator faithful? Known answers of statics, measured before any grasp is certified.

With mu the friction, N the normal force of a contact:

* a box on a slope of four contacts slides when the tangential load passes mu times the normal one,
  whatever the direction;
* a box between two pairs of fingers slips when it is pulled with more than 4 mu N, whatever the
  direction across the normals;
* a grasp under a part of the load that it resists does not creep;
* a blow-up is reported, and does not put everything back to the start.

The loads at which the boxes slip are found and judged exactly as those of grasps are, so that
thresholds too loose to notice a slip are refused with settings that slip falsely.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from grasp_core.arrays import Array
from grasp_core.errors import UnfaithfulError
from grasp_core.resisted_wrenches import WrenchBody, axis_wrenches
from grasp_core.values import Contact, contact_frictions
from grasp_core.versions import versions
from scenes.mjcf import build_scene
from scenes.objects import example_object
from sim_validate.limits import bisected_limits, part
from sim_validate.rig import Rig, squeezed
from sim_validate.schedules import Load
from sim_validate.setup import Setup
from sim_validate.simulate import Bench

FRICTION = 0.5
AZIMUTHS_DEG = (0.0, 22.5, 45.0, 67.5)
SLIP_TOLERANCE = 0.005
"""How far the load at which a box slips may be off, relative to statics."""
CREEP_LIMIT = 5e-5
"""Fastest creep under load, in grasp sizes per second: ten times what good settings show."""
CREEP_LOAD = 0.8
PUSH = 0.6
"""Normal force of the fingers on the box, in largest normal forces."""
BLOW_UP = 1e14
"""A load that no simulation survives [N]."""
CLOCK_SLACK_S = 1e-9


@dataclass(frozen=True, slots=True)
class Check:
    """One figure, and where it must lie."""

    name: str
    value: float
    """NaN where nothing could be measured."""
    least: float
    largest: float

    @property
    def passed(self) -> bool:
        """Whether the figure is where it must be."""
        return self.least <= self.value <= self.largest

    def __str__(self) -> str:
        state = "ok" if self.passed else "OUT OF TOLERANCE"
        return (
            f"{self.name}: {self.value:.6g} (from {self.least:.6g} to {self.largest:.6g}) {state}"
        )


@dataclass(frozen=True, slots=True)
class Gate:
    """What the simulator made of the known cases."""

    checks: tuple[Check, ...]
    mujoco: str
    """Version of the simulator."""

    @property
    def passed(self) -> bool:
        """Whether all figures are where they must be."""
        return all(check.passed for check in self.checks)


def require_faithful(setup: Setup) -> Gate:
    """The gate's figures.

    Raises:
        UnfaithfulError: One is out of tolerance; nothing simulated with this setup would count.
    """
    gate = measured_gate(setup)
    if not gate.passed:
        failed = "; ".join(str(check) for check in gate.checks if not check.passed)
        raise UnfaithfulError(
            f"the simulator is not faithful with these settings, so nothing is certified: {failed}"
        )
    return gate


def measured_gate(setup: Setup) -> Gate:
    """Measure the known cases, once per process for the same settings."""
    fingers = replace(setup.fingers, radius_m=None, approach=None)
    return _measured(replace(setup, fingers=fingers, surface="pads", threads=1, timeout_s=math.inf))


@lru_cache(maxsize=8)
def _measured(setup: Setup) -> Gate:
    checks = (*_incline(setup), *_pulled_box(setup), _creep(setup), _blow_up(setup))
    return Gate(checks, versions()["mujoco"])


def _incline(setup: Setup) -> list[Check]:
    """Four rigid supports under a box that weighs on them and is pulled sideways."""
    body = example_object("box")
    length, width, height = np.ptp(body.vertices, axis=0)
    corners = [(s * length / 4, t * width / 4) for s in (-1, 1) for t in (-1, 1)]
    contacts = [Contact(np.array([x, y, -height / 2]), np.array([0, 0, 1.0])) for x, y in corners]
    fingers = replace(setup.fingers, drive="rigid")
    scene = build_scene(body, contacts, FRICTION, fingers=fingers, physics=setup.physics)
    weight = setup.fingers.max_normal_force_n
    resting = Load(np.array([0, 0, -weight, 0, 0, 0.0]), np.zeros((4, 3)))
    rig = Rig(Bench(scene), setup, FRICTION, resting, None)
    limits = [
        Load(resting.wrench + FRICTION * weight * np.array([*way, 0, 0, 0, 0]), np.zeros((4, 3)))
        for way in _ways()
    ]
    return _slips("slope at which a box slides, over friction", rig, limits)


def _pulled_box(setup: Setup) -> list[Check]:
    """Four fingers on two opposite faces of a box that is pulled across their normals."""
    body = example_object("box")
    length, width, _ = np.ptp(body.vertices, axis=0)
    contacts = [
        Contact(np.array([s * length / 2, t * width / 4, 0.0]), np.array([-s, 0.0, 0.0]))
        for s in (-1.0, 1.0)
        for t in (-1.0, 1.0)
    ]
    scene = build_scene(body, contacts, FRICTION, fingers=setup.fingers, physics=setup.physics)
    push = PUSH * setup.fingers.max_normal_force_n
    forces = push * np.array([contact.normal for contact in contacts])
    rig = squeezed(Bench(scene), setup, forces, FRICTION)
    largest = 4.0 * FRICTION * push
    limits = [
        Load(np.array([0, *(largest * way), 0, 0, 0]), forces - np.array([0, *(largest * way / 4)]))
        for way in _ways()
    ]
    return _slips("pull at which a held box slips, over 4 mu N", rig, limits)


def _ways() -> list[Array]:
    turns = np.radians(AZIMUTHS_DEG)
    return list(np.column_stack([np.cos(turns), np.sin(turns)]))


def _slips(name: str, rig: Rig, limits: Sequence[Load]) -> list[Check]:
    """How the loads at which a box slips compare with those of statics."""
    tolerance = (1.0 - SLIP_TOLERANCE, 1.0 + SLIP_TOLERANCE)
    found = bisected_limits(rig, limits)
    return [
        Check(f"{name}, at {azimuth:g} deg", math.nan if at is None else at.share, *tolerance)
        for azimuth, at in zip(AZIMUTHS_DEG, found, strict=True)
    ]


def _creep(setup: Setup) -> Check:
    """The fastest creep of a tetrahedron held at the centres of its faces, under twelve loads."""
    rig, limits = _tetrahedron(setup)
    traces = rig.hold([part(rig.idle, limit, CREEP_LOAD) for limit in limits])
    fastest = max(
        float(trace.displacements_m[-1] - trace.displacements_m[len(trace.times_s) // 2])
        / float(trace.times_s[-1] - trace.times_s[len(trace.times_s) // 2])
        for trace in traces
    )
    speed = fastest / rig.bench.scene.layout.grasp_size_m
    return Check("creep under load, in grasp sizes per second", speed, -CREEP_LIMIT, CREEP_LIMIT)


def _blow_up(setup: Setup) -> Check:
    """By how much the clock is off after a load that makes numbers overflow."""
    rig, _ = _tetrahedron(setup)
    (trace,) = rig.hold([Load(np.full(6, BLOW_UP), rig.idle.forces)])
    seen = not trace.finite or trace.warnings > 0
    error = trace.clock_error_s if seen else math.nan
    name = "simulated less stepped time after a blow-up, in seconds"
    return Check(name, error, -CLOCK_SLACK_S, CLOCK_SLACK_S)


def _tetrahedron(setup: Setup) -> tuple[Rig, list[Load]]:
    body = example_object("tetrahedron")
    contacts = [Contact(face.centroid, face.normal) for face in body.faces]
    scene = build_scene(body, contacts, FRICTION, fingers=setup.fingers, physics=setup.physics)
    push = PUSH * setup.fingers.max_normal_force_n
    rig = squeezed(Bench(scene), setup, push * body.normals, FRICTION)
    arms = np.array([contact.position for contact in contacts]) - body.center_of_mass
    resisted = WrenchBody(
        arms, body.normals, contact_frictions(FRICTION, 4), setup.fingers.max_normal_force_n
    )
    found = [resisted.limit(wrench) for wrench in axis_wrenches(body.radius)]
    return rig, [Load(limit.limit * limit.wrench, limit.forces) for limit in found]
