"""Checks the simulator on cases with known answers before any grasp is simulated.

It is checked with the settings, friction and object size in force: on cases from statics, and,
where fingertips touch the mesh itself, for the normals and depths with which they touch its faces.
If a check fails, no grasp is simulated, and no verdict on the mesh counts.

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

A solver that stops early lets contacts slip that would hold. This shows first in two places: where
fingers push so lightly that hardly anything keeps the object from turning about the line between
two others, and on small objects, because tolerances are absolute. Whole trials are therefore
compared for two bodies: a tetrahedron under load, and a box with two offset fingers that need its
friction and two more that hardly push. The box is released at the friction under test and at a low
one as well: even where the friction under test is high, the critical friction of a grasp may be
low, and friction is lowered to it.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from grasp_core.arrays import Array
from grasp_core.closure.contacts import contact_frictions, stacked
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.quality.wrench_limits import WrenchBody, axis_wrenches, limit_of
from grasp_core.values import Contact
from sim_validate.engine.held_or_let_go import holds
from sim_validate.engine.known_cases import (
    DEPTH,
    DEPTH_ERROR,
    NORMAL_ERROR,
    GateCheck,
    angles,
    near,
    sized,
    touch_checks,
    two_digits,
)
from sim_validate.engine.rig import Rig, squeezed
from sim_validate.engine.schedules import Schedule, TrialLoad, part
from sim_validate.engine.setup import Setup
from sim_validate.engine.simulated_friction import bisected, forces_just_above, released_friction
from sim_validate.engine.simulated_limits import SimulatedLimit, bisected_limits, ramped_limits
from sim_validate.engine.stepping import CLOCK_SLACK_S, Bench
from sim_validate.settings import USUAL_FRICTION

LEAST_OFFSET, MOST_OFFSET_FRICTION = 0.01, 1.0
"""Least and largest critical friction that two offset fingers on the box can be made to need."""
PUSH = 0.6
"""Normal force of the fingers on the box, relative to the largest normal force allowed."""


USUAL_RADIUS_M = 0.07


@dataclass(frozen=True, slots=True)
class ClosureCase:
    """The settings, friction and object size with which the simulator is checked on known cases."""

    setup: Setup
    friction: float
    radius_m: float

    @classmethod
    def of(
        cls, setup: Setup, friction: float = USUAL_FRICTION, radius_m: float = USUAL_RADIUS_M
    ) -> Self:
        """Make the case for some settings, without those that known cases do not use."""
        fingers = replace(setup.fingers, fingertip_radius_m=None, approach=None)
        surface = setup.surface or "object"  # as on the known cases
        plain = replace(setup, fingers=fingers, surface=surface, threads=1, timeout_s=math.inf)
        return cls(plain, friction, two_digits(radius_m))

    @property
    def offset_friction(self) -> float:
        """The friction under test, or the nearest one that offset fingers on a box can need."""
        return min(max(self.friction, LEAST_OFFSET), MOST_OFFSET_FRICTION)

    @property
    def push(self) -> float:
        """The normal force of each finger on the box [N]."""
        return PUSH * self.setup.fingers.max_normal_force_n

    def body(self, name: str) -> Polyhedron:
        """Scale an example object to the size under test."""
        return sized(name, self.radius_m)

    def checks(self) -> tuple[GateCheck, ...]:
        """Measure all figures, on what the settings have fingertips touch."""
        touches = () if self.setup.surface == "pads" else surface_touches(self)
        held = tetrahedron(self)
        return (
            *touches, *_incline(self), *_pulled_box(self), *_twisted_box(self),
            *_offset_fingers(self), _creep(*held), _hidden(held[0]), *solver_gaps(self),
            _blow_up(held[0]),
        )  # fmt: skip

    def squeezed(
        self, body: Polyhedron, contacts: Sequence[Contact], forces: Array, friction: float
    ) -> Rig:
        """Close fingers on a body with planned forces, for trials of full length."""
        bench = Bench(self.setup.scene(body, contacts, friction))
        return replace(squeezed(bench, self.setup, forces, friction), whole=True)


def tetrahedron(case: ClosureCase) -> tuple[Rig, list[TrialLoad]]:
    """Squeeze a tetrahedron at its face centres, and find its limit wrenches on twelve axes."""
    body, largest = case.body("tetrahedron"), case.setup.fingers.max_normal_force_n
    contacts = [Contact(face.centroid, face.normal) for face in body.faces]
    rig = case.squeezed(body, contacts, PUSH * largest * body.normals, case.friction)
    arms = stacked(contacts)[0] - body.center_of_mass
    frictions = contact_frictions(case.friction, len(contacts))
    resisted = WrenchBody(arms, body.normals, frictions, largest)
    found = [limit_of(resisted, wrench) for wrench in axis_wrenches(body.radius)]
    return rig, [TrialLoad(limit.limit * limit.wrench, limit.forces) for limit in found]


AZIMUTHS_DEG = (0.0, 22.5, 45.0, 67.5)
AT_AZIMUTHS = [f", at {azimuth:g} deg" for azimuth in AZIMUTHS_DEG]
PLACE_SIGNS = [(s, t) for s in (-1.0, 1.0) for t in (-1.0, 1.0)]
"""Signs of the places of four contacts, two on each of two opposite faces."""
SLIP_TOLERANCE = 0.005
"""Largest error of the load at which a box slips, relative to the load that statics predicts."""
LEAST_LEVER = 0.05
"""Least lever of the fingers on a box that is twisted, in widths of the box."""
CREEP_LIMIT = 1e-4
"""Fastest creep allowed under load, in grasp sizes per second; good settings show a twentieth of
it."""
CREEP_SHARE = 0.2
"""Largest share of a hold's displacement threshold that creep may use up."""
SHARE_HELD = 0.8
"""Load on the tetrahedron, relative to the largest load that it resists."""
HIDDEN_LIMIT = 0.01
"""Largest force that may act without a threshold noticing it, relative to the largest normal force.
It is ten times what the usual thresholds let pass."""
NEAR_CRITICAL = 0.01
"""Distance from the critical friction, relative to it, at which a hold must tell whether the object
stays."""
BLOW_UP = 1e14
"""Each part of a load that no simulation survives [N, N m]."""


def _incline(case: ClosureCase) -> list[GateCheck]:
    """Let a box weigh on four rigid supports, pull it at their level, and check when it slides."""
    body = case.body("box")
    length, width, height = np.ptp(body.vertices, axis=0)
    contacts = [
        Contact(np.array([s * length / 4, t * width / 4, -height / 2]), np.array([0, 0, 1.0]))
        for s, t in PLACE_SIGNS
    ]
    rigid = replace(case.setup, fingers=replace(case.setup.fingers, drive="rigid"))
    weight = case.setup.fingers.max_normal_force_n
    resting = TrialLoad(np.array([0, 0, -weight, 0, 0, 0.0]), np.zeros((4, 3)))
    bench = Bench(rigid.scene(body, contacts, case.friction))
    rig = Rig(bench, case.setup, case.friction, resting, None, whole=True)
    pulls = [case.friction * weight * np.array([*way, 0.0]) for way in _ways()]
    torques = [np.cross([0.0, 0.0, -height / 2], pull) for pull in pulls]  # so that it cannot tip
    limits = [
        TrialLoad(resting.wrench + np.concatenate([pull, torque]), resting.forces)
        for pull, torque in zip(pulls, torques, strict=True)
    ]
    name = "slope at which a box slides, over friction"
    return _slips(name, bisected_limits(rig, limits), AT_AZIMUTHS)


def _pulled_box(case: ClosureCase) -> list[GateCheck]:
    """Pull a box that fingers hold on two opposite faces, and check when it slips."""
    body = case.body("box")
    length, width, _ = np.ptp(body.vertices, axis=0)
    rig = _held_across(case, body, length, width / 4)
    forces, largest = rig.idle.forces, 4.0 * case.friction * case.push
    limits = [
        TrialLoad(np.array([0, *pull, 0, 0, 0]), forces - np.array([0, *(pull / 4)]))
        for pull in [largest * way for way in _ways()]
    ]
    return _by_both("pull at which a held box slips, over 4 mu N", rig, limits, AT_AZIMUTHS)


def _held_across(case: ClosureCase, body: Polyhedron, length: float, lever: float) -> Rig:
    contacts = [
        Contact(np.array([s * length / 2, t * lever, 0.0]), np.array([-s, 0.0, 0.0]))
        for s, t in PLACE_SIGNS
    ]
    return case.squeezed(body, contacts, case.push * stacked(contacts)[1], case.friction)


def _twisted_box(case: ClosureCase) -> list[GateCheck]:
    """Twist a box that soft fingers hold on two opposite faces, and check when it turns."""
    friction, soft = case.friction, case.setup.physics.torsion_m
    if not soft:
        return []
    body = case.body("box")
    length, width, _ = np.ptp(body.vertices, axis=0)
    # where both parts resist alike, if that is on the faces and apart enough
    lever = min(max(soft / friction, LEAST_LEVER * width), width / 4.0)
    rig = _held_across(case, body, length, lever)
    each = math.hypot(friction * lever, soft)
    # a point of the limit surface: sliding and turning as fast as one rigid body does
    slides = case.push * friction**2 * lever / each
    limit = TrialLoad(
        np.array([0, 0, 0, 4.0 * case.push * each, 0, 0]),
        rig.idle.forces - np.array([[0.0, 0.0, t * slides] for _, t in PLACE_SIGNS]),
    )
    name = "twist at which a held box turns, over 4 N sqrt((mu a)^2 + mu_t^2)"
    return _by_both(name, rig, [limit], [""])


def _ways() -> list[Array]:
    turns = np.radians(AZIMUTHS_DEG)
    return list(np.column_stack([np.cos(turns), np.sin(turns)]))


def _by_both(
    name: str, rig: Rig, limits: Sequence[TrialLoad], ways: Sequence[str]
) -> list[GateCheck]:
    held, ramped = bisected_limits(rig, limits), ramped_limits(rig, limits)
    return [*_slips(f"{name}, by holds", held, ways), *_slips(f"{name}, by ramps", ramped, ways)]


def _slips(
    name: str, found: Sequence[SimulatedLimit | None], ways: Sequence[str]
) -> list[GateCheck]:
    """Compare the loads at which a box slips with those of statics, one check per direction."""
    return [
        near(f"{name}{way}", at and at.share, SLIP_TOLERANCE)
        for way, at in zip(ways, found, strict=True)
    ]


def _offset_fingers(case: ClosureCase) -> list[GateCheck]:
    """Offset two fingers on each of two opposite faces, and check at which friction they let go."""
    body = case.body("box")
    length, _, distance = np.ptp(body.vertices, axis=0)
    critical = case.offset_friction
    gap = length / 20.0
    shift = 0.5 * critical * distance + gap
    contacts = [
        Contact(np.array([s * shift + t * gap, 0.0, s * distance / 2]), np.array([0.0, 0.0, -s]))
        for s, t in PLACE_SIGNS
    ]
    places = stacked(contacts)
    bench = Bench(case.setup.scene(body, contacts, critical))
    released = released_friction(bench, *places, critical, case.setup, whole=True).simulated
    rig = case.squeezed(body, contacts, case.push * forces_just_above(*places, critical), critical)

    def stays(frictions: list[float]) -> list[bool | None]:
        traces = [
            rig.traced(replace(rig, friction=each).holds([rig.idle]))[0] for each in frictions
        ]
        return [holds(trace, rig.bench.scene.layout, case.setup.hold) for trace in traces]

    held = bisected(stays, critical, case.setup.friction)
    name = "friction at which offset fingers let go, over h / w"
    return [
        near(f"{name}, by releases", released and released / critical, SLIP_TOLERANCE),
        near(f"{name}, by holds", held and sum(held) / (2.0 * critical), NEAR_CRITICAL),
    ]


def _creep(rig: Rig, limits: Sequence[TrialLoad]) -> GateCheck:
    """Check how fast a held object creeps under a part of the loads that it resists."""
    speeds, protocol = list[float](), rig.setup.hold
    # the mean speed in the second half; NaN if the trial is not valid
    for trace in rig.traced(rig.holds([part(rig.idle, limit, SHARE_HELD) for limit in limits])):
        half = len(trace.times_s) // 2
        if trace.health.fault or not half:
            speeds.append(math.nan)
        else:
            moved = trace.displacements_m[-1] - trace.displacements_m[half - 1]
            speeds.append(float(moved / (trace.times_s[-1] - trace.times_s[half - 1])))
    # the maximum is NaN if one speed is
    speed = float(np.abs(speeds).max()) / rig.bench.scene.layout.grasp_size_m
    most = min(CREEP_LIMIT, CREEP_SHARE * protocol.hold_threshold / protocol.hold_s)
    return GateCheck("creep under load, in grasp sizes per second", speed, 0.0, most)


def _hidden(rig: Rig) -> GateCheck:
    """Check how large a force may be before the displacement thresholds notice it."""
    layout, setup = rig.bench.scene.layout, rig.setup
    threshold = max(
        setup.hold.hold_threshold, setup.hold.total_threshold, setup.hold.gap_threshold,
        setup.limit.ramp_threshold, setup.friction.threshold,
    )  # fmt: skip
    hidden = layout.drive.stiffness_n_per_m * threshold * layout.grasp_size_m
    share = hidden / setup.fingers.max_normal_force_n
    name = "force hidden below the thresholds, over the largest normal force"
    return GateCheck(name, share, 0.0, HIDDEN_LIMIT)


def _blow_up(rig: Rig) -> GateCheck:
    """Check the simulator's clock after a load so large that numbers overflow."""
    (trace,) = rig.traced(rig.holds([TrialLoad(np.full(6, BLOW_UP), rig.idle.forces)]))
    seen = not trace.health.finite or trace.health.warnings > 0
    error = trace.health.clock_error_s if seen else math.nan
    name = "simulated less stepped time after a blow-up, in seconds"
    return GateCheck(name, error, -CLOCK_SLACK_S, CLOCK_SLACK_S)


GAP_LIMIT = 1e-9
"""Largest difference of a position or angle between the two solvers, in grasp sizes: a
ten-thousandth of the finest threshold. Usual solvers differ by 8e-12 at most, on a millimetre at
friction 0.05, and else by 1e-15. Solvers that are known to slip falsely differ by 1.6e-9 and more.
"""
LOW, LOW_GAP_LIMIT = 0.05, 1e-7
"""Friction from which downwards a released box is judged by the second limit, which is the largest
difference between the two solvers there, in grasp sizes: a hundredth of the finest threshold. Usual
solvers differ by 2e-8 at most, on a millimetre. Solvers under which boxes of that size were seen to
let go far above their critical friction, implicit integrators among them, differ by 4e-5."""
LIGHT_PUSH = 1e-3
"""Normal force of the two fingers that hardly push, relative to that of the others."""
RELEASED_ABOVE = (1.01, 1.05, 2.0)
"""Frictions at which the box is released, relative to the friction that it needs; it stays at
each."""


def solver_gaps(case: ClosureCase) -> tuple[GateCheck, GateCheck]:
    """Compare motions under the chosen solver with motions under one that iterates to the end."""
    physics = replace(
        case.setup.physics, solver="Newton", jacobian="dense", tolerance=1e-18, iterations=300,
        ls_iterations=100, ls_tolerance=1e-3,
    )  # fmt: skip
    exact = replace(case, setup=replace(case.setup, physics=physics))
    both = case, exact
    held = [_held(each) for each in both]
    released = [_released(each, case.offset_friction) for each in both]
    low = [_released(each, LEAST_OFFSET) for each in both]
    here, there = ([held, released], [low]) if case.friction >= LOW else ([held], [released, low])
    name = "motion that a solver to the last digit changes"
    return (
        GateCheck(name, _gap(here), 0.0, GAP_LIMIT),
        GateCheck(f"{name}, at friction {LEAST_OFFSET:g}", _gap(there), 0.0, LOW_GAP_LIMIT),
    )


def _gap(pairs: Sequence[Sequence[Array]]) -> float:
    gaps = [np.max(np.abs(one - other)) for one, other in pairs]
    return float(np.max(gaps))  # the maximum is NaN if one difference is


def _held(case: ClosureCase) -> Array:
    """Simulate the held tetrahedron; return joint positions (trials, n, q) in grasp sizes."""
    rig, limits = tetrahedron(case)
    return _in_sizes(rig, rig.holds([part(rig.idle, limit, SHARE_HELD) for limit in limits]))


def _in_sizes(rig: Rig, trials: Sequence[Schedule]) -> Array:
    joints = rig.joints(trials)
    scale = np.full(joints.shape[-1], rig.bench.scene.layout.grasp_size_m)
    scale[3:7] = 1.0  # a quaternion
    return joints / scale


def _released(case: ClosureCase, needed: float) -> Array:
    """Release a box at frictions above the one it needs; return joint positions as `_held` does.

    Fingers squeeze it along an oblique line from above and below; two side fingers hardly push.
    """
    body = case.body("box")
    _, width, height = np.ptp(body.vertices, axis=0)
    shift = 0.5 * needed * height
    # The side fingers stand off centre, because symmetry hides faults.
    contacts = [
        *(Contact(np.array([s * shift, 0.0, s * height / 2]), np.array([0.0, 0.0, -s]))
          for s in (-1.0, 1.0)),
        *(Contact(np.array([0.13 * height, s * width / 2, 0.07 * height]), np.array([0.0, -s, 0.0]))
          for s in (-1.0, 1.0)),
    ]  # fmt: skip
    pushes = np.array([1.0, 1.0, LIGHT_PUSH, LIGHT_PUSH])[:, None] * stacked(contacts)[1]
    pushes[:2, 0] = needed * np.array([1.0, -1.0])
    box = case.squeezed(body, contacts, case.push * pushes, needed)
    settling = case.setup.friction.settling_friction * needed
    return _in_sizes(box, box.releases(settling, [above * needed for above in RELEASED_ABOVE]))


MANY_FACED, FINGERS_AT_ONCE = "random-100-1", 20


def surface_touches(case: ClosureCase) -> tuple[GateCheck, GateCheck]:
    """Check how fingertips that are put a little into a mesh with many faces touch them."""
    body, found = case.body(MANY_FACED), list[tuple[Array, Array, float]]()
    contacts = [Contact(face.centroid, face.normal) for face in body.faces]
    rigid = replace(case.setup.fingers, drive="rigid", indentation=0.0)
    depth = DEPTH * body.radius
    for start in range(0, len(contacts), FINGERS_AT_ONCE):
        group, setup = contacts[start : start + FINGERS_AT_ONCE], replace(case.setup, fingers=rigid)
        size = setup.scene(body, group, 1.0).layout.grasp_size_m
        setup = replace(setup, fingers=replace(rigid, indentation=depth / size))
        scene, faces = setup.scene(body, group, 1.0), stacked(group)[1]
        normals, depths = Bench(scene).touched(scene.layout.holder.tip_names)
        depths /= depth
        off = np.maximum(angles(normals, faces) / NORMAL_ERROR, np.abs(depths - 1.0) / DEPTH_ERROR)
        worst = int(np.argmax(np.nan_to_num(off, nan=np.inf)))
        found.append((normals[worst], faces[worst], float(depths[worst])))
    normals, faces, depths = map(np.array, zip(*found, strict=True))
    return touch_checks(normals, faces, depths)
