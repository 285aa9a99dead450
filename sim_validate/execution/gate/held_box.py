"""Checks executions on a box between four fingers, whose motion is known in closed form.

With the pushes N, stiffness k, friction mu, masses m of the box and m_t of a fingertip, and radius
rho of the fingertips:

* a weight along z makes the box slip at 4 mu N, and so does the weight together with an upward
  acceleration a of the palm, at m (g + a) = 4 mu N;
* four fingers that all push along x let the box slip at 4 mu N in any direction across x;
* a load F along any axis moves the box by F / (4 k) against the palm, as the four springs are as
  stiff in all directions, and a palm in uniform motion changes neither this motion nor the forces;
* a load F that comes and goes suddenly leaves F - m x'' to the contacts, with the step response of
  a mass M = m + 4 m_t on 4 k and its dampers, and contacts that stick do not creep;
* the box rings along an axis with K = 4 k and M = m + 4 m_t, and about z with

      K = 2 k (a^2 + b^2) - 2 N (a - rho) - 2 N (b - rho),   M = I_z + 2 m_t (a^2 + b^2),  (1)

  about x with K = 2 k b^2 - 2 N (b - rho) and M = I_x + 2 m_t b^2, and about y as about x with a
  for b. The damper of each spring has c / k in proportion, so C = c / k times the part of K without
  N, and the frequency is sqrt(K / M - (C / 2 M)^2).
"""

import importlib
import math
from dataclasses import replace
from typing import Any

import numpy as np

from grasp_core.arrays import Array
from scenes.execution.held import HeldLayout
from scenes.execution.held_mjcf import SAMPLE_S, held_physics
from sim_validate.execution import paths
from sim_validate.execution.bench import HeldBench, HeldMotion
from sim_validate.execution.drives import Drive, idle
from sim_validate.execution.gate.held_case import (
    DOWN,
    FINGERS,
    SETTLE_S,
    SLOW,
    TOLERANCE,
    HeldCase,
    known,
    near,
)
from sim_validate.execution.slips import SLID, outcome, seen, slides
from sim_validate.simulation.known_cases import Check

WINDOW = 0.03
"""Loads from which and to which a ramp is slow, from the load of slip, relative to it. Loads change
once per sample and the box follows within one, so this divided by the samples of half a rise is the
error of a load of slip: a fifth of a percent."""
OBLIQUE = math.radians(30.0)
"""Angle from z of a weight across contacts whose cones may have edges."""
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
"""Part of the load of slip that is the palm's acceleration, where it rises."""
SPEED_M_PER_S = 1.0
"""Speed of a palm in uniform motion, which must change nothing."""
CREEP = 0.2
"""Largest creep of contacts that stick in the longest trial, over what counts as slipped."""
JUMP, JUMP_SHARE = 6, 0.4
"""Samples for which a sudden load stays, and its size relative to a light one: forces overshoot to
twice a jump at most."""
SPARE = 8
"""Samples of a ring beyond its periods."""
SETTLED = 8.0
"""Time that a held load stays before it is measured, in the damper's own times c / k."""


def held_box(case: HeldCase) -> tuple[Check, ...]:
    """Check the load of slip, the deflection, the frequencies, and a palm in uniform motion."""
    bench = HeldBench(case.held_box())
    _, start = bench.settled(paths.closing(SETTLE_S))
    ramps = [_ramp(case, 0.0), _ramp(case, RISING)]
    still = _held_load(case)
    moving = replace(still, velocity=SPEED_M_PER_S * np.array([0.6, 0.8, 0.0]))
    sudden = _sudden_load(case)
    motions = bench.run([*ramps, still, moving, sudden], start)
    layout, friction = bench.scene.layout, bench.scene.layout.friction
    slips = [
        known(motion, (1.0 + WINDOW) * outcome(motion, layout, drive, friction).first_slip)
        for motion, drive in zip(motions[:2], ramps, strict=True)
    ]
    rest, uniform = (seen(motion, layout) for motion in motions[2:4])
    spring = case.light_n / (FINGERS * case.stiffness_n_per_m)
    gone = rest.moved[-_period(case) :].mean(axis=0) / spring
    apart = float(np.abs(uniform.moved - rest.moved).max()) / spring
    pulled = float(np.abs(uniform.forces - rest.forces).max()) / case.light_n
    return (
        near("weight at which a held box slips, over 4 mu N", slips[0]),
        _oblique(case),
        near("m (g + a) at which a held box slips in a palm that rises, over 4 mu N", slips[1]),
        *(near(f"deflection along {axis}, over load / 4 k", known(motions[2], ratio))
          for axis, ratio in zip("xyz", gone.tolist(), strict=True)),
        Check("motion that uniform motion of the palm adds, over the deflection",
              known(motions[3], apart), 0.0, TOLERANCE),
        Check("contact force that uniform motion of the palm adds, over the load",
              known(motions[3], pulled), 0.0, TOLERANCE),
        _creep(case, motions[2], layout),
        _jumps(case, motions[4], layout),
        *_rings(case.lightly_damped(RING_DAMPING)),
    )  # fmt: skip


def _oblique(case: HeldCase) -> Check:
    """Let a box weigh obliquely on fingers that all push along x, and check when it slips."""
    bench = HeldBench(case.clamped_box())
    _, start = bench.settled(paths.closing(SETTLE_S))
    drive = _ramp(case, 0.0, np.array([0.0, math.sin(OBLIQUE), -math.cos(OBLIQUE)]))
    (motion,) = bench.run([drive], start)
    found = outcome(motion, bench.scene.layout, drive, bench.scene.layout.friction)
    name = "weight at which a box slips obliquely across its contacts, over 4 mu N"
    return near(name, known(motion, (1.0 + WINDOW) * found.first_slip))


def _ramp(case: HeldCase, rising: float, way: Array = DOWN) -> Drive:
    """Return the drive in which a weight grows past slip, a part of it as the palm's rise."""
    low = (1.0 - WINDOW) / (1.0 + WINDOW)
    last = case.rise_of(0.5 * SLOW)
    share = np.concatenate([low * case.rise, low + (1.0 - low) * last])
    whole = (1.0 + WINDOW) * case.slip_n / case.mass_kg * share[:, None] * way
    drive = replace(idle(len(share)), gravity=(1.0 - rising) * whole, shares=share)
    accelerations = np.hstack([-rising * whole, np.zeros((len(share), 3))])
    return replace(drive, accelerations=accelerations)


def _held_load(case: HeldCase) -> Drive:
    """Return the drive in which a light load along each axis grows, and stays."""
    lag = SETTLED * 2.0 * case.damping_ratio / case.frequency
    share = np.concatenate([case.rise, np.ones(paths.samples(lag) + _period(case))])
    wrenches = case.light_n * share[:, None] * np.repeat([1.0, 0.0], 3)
    return replace(idle(len(share)), wrenches=wrenches, shares=share)


def _creep(case: HeldCase, motion: HeldMotion, layout: HeldLayout) -> Check:
    """Check how far contacts that stick creep in the time of the longest trial."""
    last = _period(case)
    slid = slides(seen(motion, layout), layout)
    speed = float(np.abs(slid[-1] - slid[-last]).max()) / ((last - 1) * SAMPLE_S)
    longest = len(paths.turned_weight(case.frequency)) * SAMPLE_S
    far = speed * longest / (SLID * case.radius_m)
    name = "creep of contacts that stick in a whole trial, over what counts as slipped"
    return Check(name, known(motion, far), 0.0, CREEP)


def _sudden_load(case: HeldCase) -> Drive:
    """Return the drive in which a load along x is there at once, and suddenly gone."""
    wrenches = np.zeros((2 * JUMP, 6))
    wrenches[:JUMP, 0] = JUMP_SHARE * case.light_n
    return replace(idle(2 * JUMP), wrenches=wrenches)


def _jumps(case: HeldCase, motion: HeldMotion, layout: HeldLayout) -> Check:
    """Check the contact forces while a load comes and goes suddenly, sample by sample.

    The simulator may be one step of h late: after each jump x'' changes by (1 + 2 zeta) w h of the
    jump in a step.
    """
    load, w, zeta = JUMP_SHARE * case.light_n, case.frequency, case.damping_ratio
    share = case.mass_kg / case.moving_kg
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
    carried = -np.einsum("kj,nkj->n", layout.axes[:, 0], motion.forces)
    off = float(np.abs(carried - right).max()) / load
    late = (1.0 + 2.0 * zeta) * w * held_physics(layout).timestep * share
    name = "error of contact forces while a load comes and goes suddenly, over the load"
    return Check(name, known(motion, off), 0.0, late)


def _period(case: HeldCase) -> int:
    """Return the samples of one period of the box along an axis, two at least."""
    return max(2, paths.samples(2.0 * math.pi / case.frequency))


def _rings(case: HeldCase) -> list[Check]:
    """Knock the box along and about all axes at once, and check how fast each of them rings."""
    scene = case.held_box()
    _, start = HeldBench(scene).settled(paths.closing(SETTLE_S))
    stiff, mass, damper = _modes(case, np.diag(scene.layout.inertia_kg_m2))
    undamped = np.sqrt(stiff / mass)
    bench = HeldBench(scene, sample_s=min(SAMPLE_S, RADIANS / float(undamped.max())))
    a, b, _ = case.halves
    amplitude = KNOCKED * min(case.friction, 1.0) * case.push / case.stiffness_n_per_m
    sizes = amplitude / np.array([1.0, 1.0, 1.0, b, a, a + b])
    count = round(PERIODS * 2.0 * math.pi / float(undamped.min()) / bench.sample_s) + SPARE
    wrenches = np.zeros((count, 6))
    wrenches[0] = mass * undamped * sizes / bench.sample_s
    (motion,) = bench.run([replace(idle(count), wrenches=wrenches)], start)
    view = seen(motion, scene.layout)
    turns = 0.5 * (view.turned - view.turned.transpose(0, 2, 1))
    rung = np.hstack([view.moved, turns[:, [2, 0, 1], [1, 2, 0]]])[1:]
    names = [f"{word} {axis}" for word in ("along", "about") for axis in "xyz"]
    rates = np.sqrt(stiff / mass - (0.5 * damper / mass) ** 2)
    return [
        near(
            f"frequency of a ring {name}, over that of mass and springs",
            known(motion, ring_frequency(points, rate, bench.sample_s) / rate),
        )
        for name, points, rate in zip(names, rung.T, rates.tolist(), strict=True)
    ]


def _modes(case: HeldCase, inertia: Array) -> Array:
    """Return stiffness, mass and damping along and about x, y and z by (1), (3, 6)."""
    a, b, _ = case.halves
    k, push, rho = case.stiffness_n_per_m, case.push, case.tip_radius_m
    damper = 2.0 * case.damping_ratio / math.sqrt(k * FINGERS / case.moving_kg)
    squares = np.array([b * b, a * a, a * a + b * b])
    geometric = 2.0 * push * np.array([b - rho, a - rho, a + b - 2.0 * rho])
    springs = k * np.array([4.0, 4.0, 4.0, *(2.0 * squares)])
    mass = np.array([*[case.moving_kg] * 3, *(inertia + 2.0 * case.tip_mass_kg * squares)])
    return np.stack([springs - np.concatenate([np.zeros(3), geometric]), mass, damper * springs])


def ring_frequency(points: Array, about: float, sample_s: float) -> float:
    """Return the frequency of a decaying ring about an unknown middle [rad/s].

    Points at equal times t obey x_2 = p x_1 - q x_0 + r with p = 2 sqrt(q) cos(w t).

    Takes `points` (n,); `about` [rad/s]; `sample_s` [s].
    """
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
