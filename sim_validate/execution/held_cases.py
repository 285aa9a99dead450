"""Checks the simulator on cases with known answers before any grasp is executed.

A box between four fingers moves as is known in closed form. With the pushes N, stiffness k,
friction mu, masses m of the box and m_t of a fingertip, and radius rho of the fingertips:

* four fingers that all push along x let the box slip at 4 mu N in any direction across x, under a
  weight together with an acceleration a of the palm against it, at m (g + a) = 4 mu N;
* a load F along any axis moves the box by F / (4 k) against the palm, as the four springs are as
  stiff in all directions, and a palm in uniform motion changes neither this motion nor the forces;
* a load F that comes and goes suddenly leaves F - m x'' to the contacts, with the step response of
  a mass M = m + 4 m_t on 4 k and its dampers, and contacts that stick do not creep;
* the box rings along an axis with K = 4 k and M = m + 4 m_t, and about z with

      K = 2 k (a^2 + b^2) - 2 N (a - rho) - 2 N (b - rho),   M = I_z + 2 m_t (a^2 + b^2),  (1)

  about x with K = 2 k b^2 - 2 N (b - rho) and M = I_x + 2 m_t b^2, and about y as about x with a
  for b. The damper of each spring has c / k in proportion, so C = c / k times the part of K without
  N, and the frequency is sqrt(K / M - (C / 2 M)^2).

A box that nothing holds falls by g t^2 / 2, and a knock with impulse J and moment L about its axis
z gives it the velocity J / m and the rate of turning L / I_z. A table under the box carries m g
until the fingers lift the box, and nothing afterwards.

Steps must be short enough where contacts open and close. A blow along x with a little more force
than that of all four pushes takes the box off the fingers behind it and lets it slide along the
others; springs and contacts bring it back. There is no closed form, so the motion is compared with
that in steps that are `STEPS_SHORTER` times as short as usual.

Fingertips must meet the faces of objects as they are, on their convex solids. A fingertip is put on
the middle of each flat piece of the surface, of a box (one solid) and of an object that is not
convex (flat pyramids). Its contact must have the normal and the depth of the face. Then all push
with the same pressure, a force p A n on a piece of area A: such forces balance on any closed
surface, so each contact must carry its own.
"""

import importlib
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from grasp_core.allowed_values import SMALLEST
from grasp_core.arrays import Array
from grasp_core.closure.contacts import contact_frictions
from grasp_core.execution.grips import grip
from grasp_core.execution.loads import GRAVITY_M_PER_S2
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.objects.surface import areas_and_normals
from grasp_core.values import Contact
from scenes.example_objects import example_object
from scenes.mujoco.fingertip_room import fitting_radius
from scenes.mujoco.held_scene import SAMPLE_S, HeldLayout, HeldScene, build_held_scene, held_physics
from scenes.mujoco.scene_text import AWAY, TOUCH_DEPTH
from scenes.mujoco_options import PhysicsSettings
from scenes.settings import UPRIGHT, HeldSettings
from sim_validate.engine.known_cases import (
    DEPTH,
    GateCheck,
    near,
    sized,
    touch_checks,
    two_digits,
)
from sim_validate.execution import paths
from sim_validate.execution.paths import TablePlane, TrialDrive, idle, samples, smoother
from sim_validate.execution.simulate import SLIPPED_BY, HeldBench, HeldMotion, outcome

DOWN = np.array(UPRIGHT)
WEIGHT_M_PER_S2 = GRAVITY_M_PER_S2 * DOWN
BOX_FINGERS = 4
TOLERANCE = 0.01
"""Largest relative error of what is known in closed form: as much as predictions are trusted to."""
SOFT_PUSH = 0.1
"""Largest push in the cases, relative to stiffness times b: the geometric stiffness of the squeeze
then takes a tenth of the springs' stiffness against turning at most."""
LIGHT_LOAD = 0.6
"""Part of the load of slip that is put on the box where it must not slip."""
SLOW_RISE = 30.0
"""Duration T of a slow rise, in reciprocal natural frequencies. Its third derivative is at most
60 / T^3, so the box rings by at most 60 / SLOW_RISE^3 of its deflection afterwards, 0.2 %."""
SQUEEZE_SETTLE_S = 0.02
"""Time after the squeeze in which it settles; it grows so slowly that little is left to settle."""
SHORTEST_RISE_S = 0.15
"""Least duration of a slow rise, so that samples are close enough to see when a contact slips."""


@dataclass(frozen=True, slots=True)
class HeldCase:
    """The settings with which executions are checked on known cases."""

    object_kg: float
    stiffness_n_per_m: float
    push_n: float
    """Largest push of a finger; the cases take less where the springs are too soft for it."""
    friction: float
    radius_m: float
    tip_radius_m: float
    tip_mass_kg: float
    damping_ratio: float
    physics: PhysicsSettings

    @property
    def halves(self) -> tuple[float, float, float]:
        """The half-widths (a, b, c) of the box [m]."""
        example = example_object("box")
        a, b, c = 0.5 * np.ptp(example.vertices, axis=0) * self.radius_m / example.radius
        return float(a), float(b), float(c)

    @property
    def push(self) -> float:
        """The push N of each finger [N]."""
        return min(self.push_n, SOFT_PUSH * self.stiffness_n_per_m * self.halves[1])

    @property
    def light_n(self) -> float:
        """A load along each axis at once under which no fingertip slips or lifts off [N]."""
        mu = self.friction  # a contact takes q, a quarter, and slips if 2^.5 q >= mu (N - q)
        return LIGHT_LOAD * BOX_FINGERS * self.push * mu / (math.sqrt(2.0) + mu)

    @property
    def lifted_n(self) -> float:
        """The weight that is lifted from a table [N]: all of it, if the fingers hold as much."""
        return min(self.object_kg * GRAVITY_M_PER_S2, self.light_n)

    @property
    def moving_kg(self) -> float:
        """What moves with the box: its own mass and that of the fingertips [kg]."""
        return self.object_kg + BOX_FINGERS * self.tip_mass_kg

    @property
    def frequency(self) -> float:
        """The natural frequency of the box along any axis, sqrt(4 k / (m + 4 m_t)) [rad/s]."""
        return math.sqrt(BOX_FINGERS * self.stiffness_n_per_m / self.moving_kg)

    def rise(self, slow: float = SLOW_RISE) -> Array:
        """Return shares of a load that grows in a time given in reciprocal frequencies, (n,)."""
        return smoother(samples(max(SHORTEST_RISE_S, slow / self.frequency)))

    def held_scene(self) -> HeldScene:
        """Build the scene of the box between its fingers."""
        a, b, _ = self.halves
        return self._boxed([(a, 0.0, 1, 0), (-a, 0.0, -1, 0), (0.0, b, 0, 1), (0.0, -b, 0, -1)])

    def clamped_scene(self) -> HeldScene:
        """Build the scene of the box with two fingers on each of the faces across x."""
        a, b, _ = self.halves
        return self._boxed([(x * a, 0.5 * y * b, x, 0) for x in (1, -1) for y in (1, -1)])

    def _boxed(self, places: list[tuple[float, float, int, int]]) -> HeldScene:
        contacts = [
            Contact(np.array([x, y, 0.0]), -np.array([out_x, out_y, 0.0]))
            for x, y, out_x, out_y in places
        ]
        squeeze = self.push * np.array([contact.normal for contact in contacts])
        return self.scene(sized("box", self.radius_m), contacts, squeeze, self.tip_radius_m)

    def checks(self) -> tuple[GateCheck, ...]:
        """Measure all figures."""
        return (*box_checks(self), *face_checks(self, "box"), *face_checks(self, "l-bracket"))

    def scene(
        self, body: Polyhedron, contacts: list[Contact], squeeze: Array, tip_radius_m: float
    ) -> HeldScene:
        """Build a scene with the springs, masses and physics under test."""
        held = grip(
            body, contacts, contact_frictions(self.friction, len(contacts)), squeeze,
            stiffness=self.stiffness_n_per_m, tip_radius_m=tip_radius_m,
        )  # fmt: skip
        settings = HeldSettings(
            mass_kg=self.object_kg, tip_mass_kg=self.tip_mass_kg, damping_ratio=self.damping_ratio
        )
        return build_held_scene(body, held, settings, physics=self.physics)


def ratio_check(name: str, motion: HeldMotion, ratio: float) -> GateCheck:
    """Check that a figure of a motion, over what is known in closed form, is one."""
    return near(name, None if motion.health.fault else ratio, TOLERANCE)


def bound_check(name: str, motion: HeldMotion, value: float, most: float = TOLERANCE) -> GateCheck:
    """Check that a figure of a motion is at most as large as it may be."""
    return GateCheck(name, math.nan if motion.health.fault else value, 0.0, most)


def cases_of(
    layout: HeldLayout, physics: PhysicsSettings, hand: HeldSettings, push_n: float
) -> tuple[HeldCase, ...]:
    """Return the case to check for each friction of a scene, with numbers of two digits."""
    # gravity points down the box's free axis, whatever its direction in the scene
    upright = replace(physics, gravity=tuple(WEIGHT_M_PER_S2.tolist()))
    numbers = {
        "object_kg": layout.object_kg, "stiffness_n_per_m": layout.stiffest, "push_n": push_n,
        "radius_m": layout.radius_m, "tip_radius_m": float(layout.tip_radius_m.max()),
        "tip_mass_kg": hand.tip_mass_kg, "damping_ratio": hand.damping_ratio,
    }  # fmt: skip
    rounded = {name: two_digits(value) for name, value in numbers.items()}
    frictions = sorted({two_digits(each) for each in layout.friction.tolist()})
    return tuple(HeldCase(**rounded, friction=each, physics=upright) for each in frictions)


WINDOW = 0.03
"""Loads from which and to which a ramp is slow, from the load of slip, relative to it. Loads change
once per sample and the box follows within one, so this divided by the samples of half a rise is the
error of a load of slip: a fifth of a percent."""
OBLIQUE = math.radians(30.0)
RING_DAMPING = 0.01
"""Damping ratio of the ring, lowered so that it lasts."""
KNOCKED = 0.05
"""Amplitude of each of the six rings, relative to the springs' displacement by the push (times
friction where that is below one)."""
PERIODS = 2.0
"""Time for which a ring is watched, in periods of its slowest axis."""
RADIANS = 0.8
"""Angle of a ring between two of the points that its frequency is taken from, at most [rad]."""
RISING = 0.5
"""Part of the load of slip that is the palm's acceleration."""
SPEED_M_PER_S, MOVING = 1.0, 20
"""Speed of a palm in uniform motion, and its samples, in which it must change nothing."""
CREEP = 0.2
"""Largest creep of contacts that stick in the longest trial, over what counts as slipped."""
JUMP, JUMP_SHARE = 6, 0.4
"""Samples for which a sudden load stays, and its size relative to a light one: forces overshoot to
twice a jump at most."""
SPARE_SAMPLES = 8
SETTLING_TIMES = 8.0
"""Time that a held load stays before it is in the damper's own times c / k."""


def box_checks(case: HeldCase) -> tuple[GateCheck, ...]:
    """Check the box between its fingers, held, struck and ringing, and without them."""
    bench = HeldBench(case.held_scene())
    squeezed, *freed = bench.run([paths.closing(SQUEEZE_SETTLE_S), *_free(case, bench)])
    start = squeezed.states[-1]
    held = (*_held(case), _blow(case))
    *motions, struck = bench.run(held, start)
    return (
        _slip(case),
        *_held_checks(case, motions),
        *_rings(replace(case, damping_ratio=RING_DAMPING), start),
        *_free_checks(case, freed),
        _struck_check(bench, held[-1], struck, start),
    )


def _held(case: HeldCase) -> tuple[TrialDrive, ...]:
    """Return drives of a load that stays, the same for a while in a moving palm, and of a jump."""
    lag = SETTLING_TIMES * 2.0 * case.damping_ratio / case.frequency
    share = np.concatenate([case.rise(), np.ones(paths.samples(lag) + _period(case))])
    wrenches = case.light_n * share[:, None] * np.repeat([1.0, 0.0], 3)
    still = replace(idle(len(share)), wrenches=wrenches, shares=share)
    moving = replace(still.rows(slice(MOVING)), velocity=SPEED_M_PER_S * np.array([0.6, 0.8, 0.0]))
    jump = np.zeros((2 * JUMP, 6))  # there at once, and suddenly gone
    jump[:JUMP, 0] = JUMP_SHARE * case.light_n
    return still, moving, replace(idle(2 * JUMP), wrenches=jump)


def _held_checks(case: HeldCase, motions: Sequence[HeldMotion]) -> tuple[GateCheck, ...]:
    """Check the deflection, a palm in uniform motion, creep, and contact forces after a jump."""
    rest, uniform, jumped = motions
    spring = case.light_n / (BOX_FINGERS * case.stiffness_n_per_m)
    gone = rest.shifts[-_period(case) :].mean(axis=0) / spring
    first = rest.rows(slice(len(uniform.moved)))
    apart = float(np.abs(uniform.shifts - first.shifts).max()) / spring
    pulled = float(np.abs(uniform.pushes - first.pushes).max()) / case.light_n
    return (
        *(ratio_check(f"deflection along {axis}, over load / 4 k", rest, ratio)
          for axis, ratio in zip("xyz", gone.tolist(), strict=True)),
        bound_check("motion that uniform motion of the palm adds, over the deflection", uniform,
                    apart),
        bound_check("contact force that uniform motion of the palm adds, over the load", uniform,
                    pulled),
        _creep(case, rest),
        _jumps(case, jumped),
    )  # fmt: skip


def _slip(case: HeldCase) -> GateCheck:
    """Check the weight, a part of it as the palm's acceleration, at which a clamped box slips."""
    bench, low = HeldBench(case.clamped_scene()), (1.0 - WINDOW) / (1.0 + WINDOW)
    _, start = bench.settled(paths.closing(SQUEEZE_SETTLE_S))
    share = np.concatenate([low * case.rise(), low + (1.0 - low) * case.rise(0.5 * SLOW_RISE)])
    slip_n = BOX_FINGERS * case.friction * case.push  # by statics
    way = np.array([0.0, math.sin(OBLIQUE), -math.cos(OBLIQUE)])
    whole = (1.0 + WINDOW) * slip_n / case.object_kg * share[:, None] * way
    accelerations = np.hstack([-RISING * whole, np.zeros((len(share), 3))])
    drive = replace(
        idle(len(share)), gravity=(1.0 - RISING) * whole, accelerations=accelerations, shares=share
    )
    (motion,) = bench.run([drive], start)
    found = outcome(motion, drive, bench.scene.layout.friction)
    name = "m (g + a) at which a box slips obliquely across its contacts, over 4 mu N"
    return ratio_check(name, motion, (1.0 + WINDOW) * found.first_slip)


def _creep(case: HeldCase, motion: HeldMotion) -> GateCheck:
    last, slid = _period(case), motion.slides()
    speed = float(np.abs(slid[-1] - slid[-last]).max()) / ((last - 1) * SAMPLE_S)
    longest = len(paths.turned_weight(case.frequency)) * SAMPLE_S
    far = speed * longest / (SLIPPED_BY * case.radius_m)
    name = "creep of contacts that stick in a whole trial, over what counts as slipped"
    return bound_check(name, motion, far, CREEP)


def _jumps(case: HeldCase, motion: HeldMotion) -> GateCheck:
    load, w, zeta = JUMP_SHARE * case.light_n, case.frequency, case.damping_ratio
    share = case.object_kg / case.moving_kg
    linalg: Any = importlib.import_module("scipy.linalg")
    # x'' follows the same equation as x, from F / M and -2 zeta w F / M on
    step = linalg.expm(SAMPLE_S * np.array([[0.0, 1.0], [-w * w, -2.0 * zeta * w]]))
    state, accelerations = np.array([1.0, -2.0 * zeta * w]), list[float]()
    for sample in range(2 * JUMP):
        if sample == JUMP:
            state = state - [1.0, -2.0 * zeta * w]
        state = step @ state
        accelerations.append(float(state[0]))
    applied = np.repeat([1.0, 0.0], JUMP)
    right = load * (applied - share * np.array(accelerations))
    carried = -np.einsum("kj,nkj->n", motion.layout.axes[:, 0], motion.forces)
    off = float(np.abs(carried - right).max()) / load
    # the simulator may be one step late, in which x'' changes by (1 + 2 zeta) w h of the jump
    late = (1.0 + 2.0 * zeta) * w * held_physics(motion.layout).timestep * share
    name = "error of contact forces while a load comes and goes suddenly, over the load"
    return bound_check(name, motion, off, late)


def _period(case: HeldCase) -> int:
    """Return the samples of one period of the box along an axis, two at least."""
    return max(2, paths.samples(2.0 * math.pi / case.frequency))


def _rings(case: HeldCase, start: Array) -> list[GateCheck]:
    """Knock the box along and about all axes at once, and check how fast each of them rings."""
    scene = case.held_scene()
    stiff, mass, damper = _modes(case, np.diag(scene.layout.inertia_kg_m2))
    undamped = np.sqrt(stiff / mass)
    bench = HeldBench(scene, sample_s=min(SAMPLE_S, RADIANS / float(undamped.max())))
    a, b, _ = case.halves
    amplitude = KNOCKED * min(case.friction, 1.0) * case.push / case.stiffness_n_per_m
    sizes = amplitude / np.array([1.0, 1.0, 1.0, b, a, a + b])
    count = round(PERIODS * 2.0 * math.pi / float(undamped.min()) / bench.sample_s) + SPARE_SAMPLES
    wrenches = np.zeros((count, 6))
    wrenches[0] = mass * undamped * sizes / bench.sample_s
    (motion,) = bench.run([replace(idle(count), wrenches=wrenches)], start)
    turns = 0.5 * (motion.turns - motion.turns.transpose(0, 2, 1))
    rung = np.hstack([motion.shifts, turns[:, [2, 0, 1], [1, 2, 0]]])[1:]
    names = [f"{word} {axis}" for word in ("along", "about") for axis in "xyz"]
    rates = np.sqrt(stiff / mass - (0.5 * damper / mass) ** 2)
    return [
        ratio_check(f"frequency of a ring {name}, over that of mass and springs", motion,
                    ring_frequency(points, rate, bench.sample_s) / rate)
        for name, points, rate in zip(names, rung.T, rates.tolist(), strict=True)
    ]  # fmt: skip


def _modes(case: HeldCase, inertia: Array) -> Array:
    """Return stiffness, mass and damping along and about x, y and z by (1), (3, 6)."""
    a, b, _ = case.halves
    k, push, rho = case.stiffness_n_per_m, case.push, case.tip_radius_m
    damper = 2.0 * case.damping_ratio / math.sqrt(k * BOX_FINGERS / case.moving_kg)
    squares = np.array([b * b, a * a, a * a + b * b])
    geometric = 2.0 * push * np.array([b - rho, a - rho, a + b - 2.0 * rho])
    springs = k * np.array([4.0, 4.0, 4.0, *(2.0 * squares)])
    mass = np.array([*[case.moving_kg] * 3, *(inertia + 2.0 * case.tip_mass_kg * squares)])
    return np.stack([springs - np.concatenate([np.zeros(3), geometric]), mass, damper * springs])


def ring_frequency(points: Array, about: float, sample_s: float) -> float:
    """Return the frequency of a decaying ring about an unknown middle [rad/s]."""
    # points at equal times t obey x_2 = p x_1 - q x_0 + r with p = 2 sqrt(q) cos(w t)
    stride = max(1, int(RADIANS / (about * sample_s)))
    first, second, third = points[: -2 * stride], points[stride:-stride], points[2 * stride :]
    scale = float(np.abs(points).max())
    if not 0.0 < scale < math.inf:
        return math.nan
    rows = np.column_stack([second, -first, np.full(len(first), scale)]) / scale
    (p, q, _), *_ = np.linalg.lstsq(rows, third / scale, rcond=None)
    if not q > 0.0 or abs(p) > 2.0 * math.sqrt(q):
        return math.nan
    return math.acos(0.5 * p / math.sqrt(q)) / (stride * sample_s)


FALL_S = 0.4
"""Time of the fall: steps of h make it h / FALL_S longer, a third of a percent at 1.25 ms [s]."""
FLIGHT_S = 0.2
"""Time in which the box flies after a knock [s]."""
KNOCK_RAD_PER_S = 2.0
"""Rate of turning after a knock: the box turns by less than half a radian in its flight."""
FINGERS_APART = 2.0
"""Distance of the fingers from their contacts, in radii of the box."""
RAISED = 4.0
"""Height of the lift, relative to the way by which the springs give under the weight."""


def _free(case: HeldCase, bench: HeldBench) -> tuple[TrialDrive, ...]:
    """Return drives of a fall and a knock without fingers, and of a lift from a table."""
    steps, flight = round(FALL_S / SAMPLE_S), round(FLIGHT_S / SAMPLE_S)
    wrenches = np.zeros((flight, 6))
    wrenches[0, 0] = case.object_kg * case.radius_m / FLIGHT_S / SAMPLE_S
    wrenches[0, 5] = bench.scene.layout.inertia_kg_m2[2, 2] * KNOCK_RAD_PER_S / SAMPLE_S
    fall = replace(idle(steps), gravity=np.tile(WEIGHT_M_PER_S2, (steps, 1)))
    knock = replace(idle(flight), wrenches=wrenches)
    lift, _ = _lift(case)
    return _apart(case, bench, fall), _apart(case, bench, knock), lift


def _free_checks(case: HeldCase, motions: Sequence[HeldMotion]) -> tuple[GateCheck, ...]:
    """Check the fall, the velocities after a knock, and what a table carries."""
    fall, knock, lifted = motions
    speed_m_per_s = case.radius_m / FLIGHT_S  # takes the box by one radius, not to the fingers
    seconds = len(fall.moved) * SAMPLE_S
    fallen = float(fall.moved[-1] @ DOWN) / (0.5 * GRAVITY_M_PER_S2 * seconds**2)
    time = (len(knock.moved) - 2) * SAMPLE_S
    speed = float(knock.moved[-1, 0] - knock.moved[1, 0]) / time
    turns = 2.0 * np.arctan2(knock.turned[:, 3], knock.turned[:, 0])
    rate = float(turns[-1] - turns[1]) / time
    weight, begun = case.lifted_n, _lift(case)[1]
    still = paths.samples(0.5 * paths.STILL_S)
    carried = -(lifted.table @ DOWN) / weight
    before = float(carried[begun - still : begun].mean())
    after = float(np.abs(carried[-still:]).max())
    return (
        ratio_check("fall of a box that nothing holds, over g t^2 / 2", fall, fallen),
        ratio_check("velocity after a knock, over J / m", knock, speed / speed_m_per_s),
        ratio_check("rate of turning after a knock, over L / I", knock, rate / KNOCK_RAD_PER_S),
        ratio_check("weight that a table carries before a lift, over m g", lifted, before),
        bound_check("weight that a table carries after a lift, over m g", lifted, after),
    )


def _apart(case: HeldCase, bench: HeldBench, drive: TrialDrive) -> TrialDrive:
    """Take the fingers and the table away from the box; the table faces it from above."""
    layout = bench.scene.layout
    back = -FINGERS_APART * case.radius_m * layout.frames[:, :, 0]
    reached = np.einsum("kij,ki->kj", layout.axes, back)
    above = TablePlane(-AWAY * case.radius_m * DOWN, DOWN)
    return replace(drive, grasping=np.zeros(len(drive)), reached=reached, table=above)


def _lift(case: HeldCase) -> tuple[TrialDrive, int]:
    """Return the drive of a lift from a table, and the sample in which it begins."""
    height = RAISED * case.lifted_n / (BOX_FINGERS * case.stiffness_n_per_m)
    drive, begun = paths.lift(-DOWN, height, SAMPLE_S * len(case.rise()))
    share = case.lifted_n / (case.object_kg * GRAVITY_M_PER_S2)
    table = TablePlane(case.halves[2] * DOWN, -DOWN)
    return replace(drive, gravity=share * drive.gravity, table=table), begun


BLOW = 1.2
"""Largest force of the blow, relative to the pushes of all fingers."""
PERIODS_WATCHED = 1.0
LEAST_WATCHED = 8
STEPS_SHORTER = 4
CHANGED = 0.25
"""Largest difference, over the largest displacement: steps of the usual length differ by 0.02 to
0.1, in a few cases by 0.2; steps twice as long by 0.27 for boxes of some grams, four times as long
by 0.4 and more."""


def _struck_check(
    bench: HeldBench, blow: TrialDrive, struck: HeldMotion, start: Array
) -> GateCheck:
    """Check how much short steps change the motion of a box that is struck off its fingers."""
    step_s = held_physics(bench.scene.layout).timestep / STEPS_SHORTER
    (short,) = HeldBench(bench.scene, step_s=step_s).run([blow], start)
    changed = float(np.abs(struck.shifts - short.shifts).max())
    changed /= max(float(np.abs(short.shifts).max()), SMALLEST)
    name = "motion of a box struck off its fingers that short steps change, over the largest"
    faulty = struck.health.fault or short.health.fault
    return GateCheck(name, math.nan if faulty else changed, 0.0, CHANGED)


def _blow(case: HeldCase) -> TrialDrive:
    """Return the drive of half a sine of force along x, as long as a knock, and what follows."""
    strike = paths.samples(paths.STRIKE_S)
    after = max(LEAST_WATCHED, paths.samples(PERIODS_WATCHED * 2.0 * np.pi / case.frequency))
    wrenches = np.zeros((strike + after, 6))
    shape = np.sin(np.pi * (np.arange(strike) + 0.5) / strike)
    wrenches[:strike, 0] = BLOW * BOX_FINGERS * case.push * shape
    return replace(idle(len(wrenches)), wrenches=wrenches)


def face_checks(case: HeldCase, name: str) -> tuple[GateCheck, ...]:
    """Check normals, depths and forces of fingertips on each face of an object."""
    body = sized(name, case.radius_m)
    pieces = [(piece, face.normal) for face in body.faces for piece in face.pieces]
    middles, areas = map(np.array, zip(*(_centroid(piece) for piece, _ in pieces), strict=True))
    normals = np.array([normal for _, normal in pieces])
    pushes = case.push * areas / areas.max()
    contacts = [Contact(*each) for each in zip(middles, normals, strict=True)]
    radius = min(case.tip_radius_m, fitting_radius(body, middles, normals))
    scene = case.scene(body, contacts, pushes[:, None] * normals, radius)
    bench = HeldBench(scene)
    into = DEPTH * case.radius_m * normals
    reached = np.einsum("kij,ki->kj", scene.layout.axes, into)
    found, depths = bench.touched(scene.layout.holder.tip_names, bench.placed(reached))
    depths /= (DEPTH + TOUCH_DEPTH) * case.radius_m
    motion, _ = bench.settled(paths.closing(SQUEEZE_SETTLE_S))
    forces = np.einsum("kij,kj->ki", scene.layout.axes, motion.forces[-1])
    missed = np.linalg.norm(forces - pushes[:, None] * normals, axis=1) / pushes
    return (
        *touch_checks(found, normals, depths, f", on a {name}"),
        bound_check(f"error of a contact's force under even pressure, on a {name}", motion,
                    float(np.max(missed))),  # NaN if one is
    )  # fmt: skip


def _centroid(corners: Array) -> tuple[Array, float]:
    triangles = np.array(
        [(corners[0], corners[i], corners[i + 1]) for i in range(1, len(corners) - 1)]
    )
    areas, _ = areas_and_normals(triangles)
    return areas @ triangles.mean(axis=1) / areas.sum(), float(areas.sum())
