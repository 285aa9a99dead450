"""Checks the simulator on cases whose answers are known from statics.

With mu the friction and N the normal force of a contact:

* a box on a slope of four contacts slides when the tangential load passes mu times the normal one,
  whatever the direction;
* a box between two pairs of fingers slips when it is pulled with more than 4 mu N, whatever the
  direction across the normals;
* with the torsional coefficient mu_t, a box between two such pairs, each finger a lever a from the
  line through the middle of both faces, turns about that line at the torque
  4 N sqrt((mu a)^2 + mu_t^2);
* a grasp under a part of the load that it resists does not creep;
* fingers on two opposite faces a distance w apart, offset by h along them, hold down to the
  friction h / w;
* the thresholds of displacement, times the stiffness of the servos, hide only a small force;
* a solver that goes on to the last digit changes no motion;
* a blow-up is reported, and does not silently reset the simulation to its start.

The loads and frictions at which the boxes slip are found and judged as those of grasps are, by
holds, ramps and releases, but every trial has its full length: that trials of grasps may end early
presumes that nothing slips later (`early_ends`). So thresholds too loose to notice a slip are
refused, like settings that slip falsely. The cases have the friction and the size of the object
under test.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from grasp_core.arrays import Array
from grasp_core.values import Contact
from sim_validate.simulation.critical_friction import bisected, forces_just_above, released_friction
from sim_validate.simulation.gate.case import PUSH, Case, Check, tetrahedron
from sim_validate.simulation.gate.convergence import solver_gaps
from sim_validate.simulation.gate.mesh_contacts import DEPTH_ERROR, NORMAL_ERROR, worst_touch
from sim_validate.simulation.hold_verdict import holds
from sim_validate.simulation.rig import Rig
from sim_validate.simulation.schedules import Load
from sim_validate.simulation.simulate import Bench
from sim_validate.simulation.traces import CLOCK_SLACK_S, Trace
from sim_validate.simulation.wrench_limits import (
    SimulatedLimit,
    bisected_limits,
    part,
    ramped_limits,
)

AZIMUTHS_DEG = (0.0, 22.5, 45.0, 67.5)
SLIP_TOLERANCE = 0.005
"""Largest error of the load at which a box slips, relative to the load that statics predicts."""
LEAST_LEVER = 0.05
"""Least lever of the fingers on a box that is twisted, in widths of the box."""
CREEP_LIMIT = 1e-4
"""Fastest creep allowed under load, in grasp sizes per second; good settings show a twentieth of
it."""
CREEP_SHARE = 0.2
"""Largest share of a hold's displacement threshold that creep may use up."""
CREEP_LOAD = 0.8
HIDDEN_LIMIT = 0.01
"""Largest force that may act without a threshold noticing it, relative to the largest normal force.
It is ten times what the usual thresholds let pass."""
NEAR = 0.01
"""Distance from the critical friction, relative to it, at which a hold must tell whether the object
stays."""
MANY_FACED, FINGERS = "random-100-1", 20
"""An example mesh with many faces, and how many fingertips touch it at a time."""
BLOW_UP = 1e14
"""Each part of a load that no simulation survives [N, N m]."""


def known_answers(case: Case) -> tuple[Check, ...]:
    """Check the simulator on all known cases, on the surface that the settings name."""
    return (
        *_incline(case), *_pulled_box(case), *_twisted_box(case), *_offset_fingers(case),
        _creep(case), _hidden(case), *solver_gaps(case), _blow_up(case),
    )  # fmt: skip


def _incline(case: Case) -> list[Check]:
    """Let a box weigh on four rigid supports, pull it at their level, and check when it slides."""
    body = case.body("box")
    length, width, height = np.ptp(body.vertices, axis=0)
    corners = [(s * length / 4, t * width / 4) for s in (-1, 1) for t in (-1, 1)]
    contacts = [Contact(np.array([x, y, -height / 2]), np.array([0, 0, 1.0])) for x, y in corners]
    rigid = replace(case.setup, fingers=replace(case.setup.fingers, drive="rigid"))
    weight = case.setup.fingers.max_normal_force_n
    resting = Load(np.array([0, 0, -weight, 0, 0, 0.0]), np.zeros((4, 3)))
    bench = Bench(rigid.scene(body, contacts, case.friction))
    rig = Rig(bench, case.setup, case.friction, resting, None, whole=True)
    pulls = [case.friction * weight * np.array([*way, 0.0]) for way in _ways()]
    torques = [np.cross([0.0, 0.0, -height / 2], pull) for pull in pulls]  # so that it cannot tip
    limits = [
        Load(resting.wrench + np.concatenate([pull, torque]), resting.forces)
        for pull, torque in zip(pulls, torques, strict=True)
    ]
    return _slips("slope at which a box slides, over friction", bisected_limits(rig, limits))


def _pulled_box(case: Case) -> list[Check]:
    """Pull a box that fingers hold on two opposite faces, and check when it slips."""
    body = case.body("box")
    length, width, _ = np.ptp(body.vertices, axis=0)
    contacts = [
        Contact(np.array([s * length / 2, t * width / 4, 0.0]), np.array([-s, 0.0, 0.0]))
        for s in (-1.0, 1.0)
        for t in (-1.0, 1.0)
    ]
    push = PUSH * case.setup.fingers.max_normal_force_n
    forces = push * np.array([contact.normal for contact in contacts])
    rig = case.squeezed(body, contacts, forces, case.friction)
    largest = 4.0 * case.friction * push
    limits = [
        Load(np.array([0, *(largest * way), 0, 0, 0]), forces - np.array([0, *(largest * way / 4)]))
        for way in _ways()
    ]
    name = "pull at which a held box slips, over 4 mu N"
    return [
        *_slips(f"{name}, by holds", bisected_limits(rig, limits)),
        *_slips(f"{name}, by ramps", ramped_limits(rig, limits)),
    ]


def _twisted_box(case: Case) -> list[Check]:
    """Twist a box that soft fingers hold on two opposite faces, and check when it turns."""
    friction, torsion_m = case.friction, case.setup.torsion_m
    if not torsion_m:
        return []
    body = case.body("box")
    length, width, _ = np.ptp(body.vertices, axis=0)
    # where both parts resist alike, if that is on the faces and apart enough
    lever = min(max(torsion_m / friction, LEAST_LEVER * width), width / 4.0)
    sides = [(s, t) for s in (-1.0, 1.0) for t in (-1.0, 1.0)]
    contacts = [
        Contact(np.array([s * length / 2, t * lever, 0.0]), np.array([-s, 0.0, 0.0]))
        for s, t in sides
    ]
    push = PUSH * case.setup.fingers.max_normal_force_n
    forces = push * np.array([contact.normal for contact in contacts])
    rig = case.squeezed(body, contacts, forces, friction)
    each = math.hypot(friction * lever, torsion_m)
    # a point of the limit surface: sliding and turning as fast as one rigid body does
    slides = push * friction**2 * lever / each
    limit = Load(
        np.array([0, 0, 0, 4.0 * push * each, 0, 0]),
        forces - np.array([[0.0, 0.0, t * slides] for _, t in sides]),
    )
    name = "twist at which a held box turns, over 4 N sqrt((mu a)^2 + mu_t^2)"
    tolerance = (1.0 - SLIP_TOLERANCE, 1.0 + SLIP_TOLERANCE)
    ways = {"holds": bisected_limits, "ramps": ramped_limits}
    found = {way: search(rig, [limit])[0] for way, search in ways.items()}
    return [
        Check(f"{name}, by {way}", math.nan if at is None else at.share, *tolerance)
        for way, at in found.items()
    ]


def _ways() -> list[Array]:
    turns = np.radians(AZIMUTHS_DEG)
    return list(np.column_stack([np.cos(turns), np.sin(turns)]))


def _slips(name: str, found: Sequence[SimulatedLimit | None]) -> list[Check]:
    """Compare the loads at which a box slips with those of statics, one check per direction."""
    tolerance = (1.0 - SLIP_TOLERANCE, 1.0 + SLIP_TOLERANCE)
    return [
        Check(f"{name}, at {azimuth:g} deg", math.nan if at is None else at.share, *tolerance)
        for azimuth, at in zip(AZIMUTHS_DEG, found, strict=True)
    ]


def _offset_fingers(case: Case) -> list[Check]:
    """Offset two fingers on each of two opposite faces, and check at which friction they let go."""
    body = case.body("box")
    length, _, distance = np.ptp(body.vertices, axis=0)
    critical = case.offset_friction
    gap = length / 20.0
    shift = 0.5 * critical * distance + gap
    contacts = [
        Contact(np.array([s * shift + t * gap, 0.0, s * distance / 2]), np.array([0.0, 0.0, -s]))
        for s in (-1.0, 1.0)
        for t in (-1.0, 1.0)
    ]
    positions = np.array([contact.position for contact in contacts])
    normals = np.array([contact.normal for contact in contacts])
    bench = Bench(case.setup.scene(body, contacts, critical))
    released = released_friction(
        bench, positions, normals, critical, case.setup, whole=True
    ).simulated
    largest = PUSH * case.setup.fingers.max_normal_force_n
    rig = case.squeezed(
        body, contacts, largest * forces_just_above(positions, normals, critical), critical
    )

    def stays(frictions: list[float]) -> list[bool | None]:
        traces = [replace(rig, friction=each).hold([rig.idle])[0] for each in frictions]
        return [holds(trace, rig.bench.scene.layout, case.setup.hold) for trace in traces]

    held = bisected(stays, critical, case.setup.friction)
    name = "friction at which offset fingers let go, over h / w"
    return [
        Check(
            f"{name}, by releases", math.nan if released is None else released / critical,
            1.0 - SLIP_TOLERANCE, 1.0 + SLIP_TOLERANCE,
        ),
        Check(
            f"{name}, by holds", math.nan if held is None else sum(held) / (2.0 * critical),
            1.0 - NEAR, 1.0 + NEAR,
        ),
    ]  # fmt: skip


def _creep(case: Case) -> Check:
    """Check how fast a tetrahedron held at its face centres creeps under twelve loads."""
    rig, limits = tetrahedron(case)
    traces = rig.hold([part(rig.idle, limit, CREEP_LOAD) for limit in limits])
    # the maximum is NaN if one speed is
    fastest = np.abs([_speed(trace) for trace in traces]).max()
    speed = float(fastest) / rig.bench.scene.layout.grasp_size_m
    noticed = case.setup.hold.hold_threshold / case.setup.hold.hold_s
    limit = min(CREEP_LIMIT, CREEP_SHARE * noticed)
    return Check("creep under load, in grasp sizes per second", speed, 0.0, limit)


def _hidden(case: Case) -> Check:
    """Check how large a force may be before the displacement thresholds notice it."""
    rig, _ = tetrahedron(case)
    layout, setup = rig.bench.scene.layout, case.setup
    threshold = max(
        setup.hold.hold_threshold, setup.hold.total_threshold, setup.hold.gap_threshold,
        setup.limit.ramp_threshold, setup.friction.threshold,
    )  # fmt: skip
    hidden = layout.drive.stiffness_n_per_m * threshold * layout.grasp_size_m
    share = hidden / setup.fingers.max_normal_force_n
    name = "force hidden below the thresholds, over the largest normal force"
    return Check(name, share, 0.0, HIDDEN_LIMIT)


def mesh_touches(case: Case) -> tuple[Check, Check]:
    """Check how fingertips touch the faces of a mesh with many faces."""
    body = case.body(MANY_FACED)
    contacts = [Contact(face.centroid, face.normal) for face in body.faces]
    groups = [contacts[start : start + FINGERS] for start in range(0, len(contacts), FINGERS)]
    touches = [worst_touch(body, group, case.setup) for group in groups]
    # the maximum is NaN if one angle is
    turned = np.max([touch.normal_error_rad for touch in touches])
    deep = np.max([touch.depth_error for touch in touches])
    return (
        Check("angle between a contact's normal and its face's", float(turned), 0.0, NORMAL_ERROR),
        Check("error of a contact's depth, relative to it", float(deep), 0.0, DEPTH_ERROR),
    )


def _speed(trace: Trace) -> float:
    """Return the mean speed in a trace's second half [m/s]; NaN if the trial is not valid."""
    half = len(trace.times_s) // 2
    if trace.fault or not half:
        return math.nan
    moved = trace.displacements_m[-1] - trace.displacements_m[half - 1]
    return float(moved / (trace.times_s[-1] - trace.times_s[half - 1]))


def _blow_up(case: Case) -> Check:
    """Check the simulator's clock after a load so large that numbers overflow."""
    rig, _ = tetrahedron(case)
    (trace,) = rig.hold([Load(np.full(6, BLOW_UP), rig.idle.forces)])
    seen = not trace.finite or trace.warnings > 0
    error = trace.clock_error_s if seen else math.nan
    name = "simulated less stepped time after a blow-up, in seconds"
    return Check(name, error, -CLOCK_SLACK_S, CLOCK_SLACK_S)
