"""What the analysis predicts for a trial: first slip and loss, from the held object's motion.

While no contact slips, the fingertips move with the surface, and the object moves by x = (d, t)
against the palm as a mass on springs:

    M x'' + C x' + K x = w,                                                               (1)
    M = M_o + sum_i W_i m_i W_i',   C = sum_i W_i C_i W_i',

with the maps W_i and the grasp stiffness K of `grasp_core.execution.grips`, the object's mass
matrix M_o, the tips' inertia m_i, (3, 3), and the dampers C_i. Of m_i the palm carries m'_i along:
all of a fingertip on slides, and nothing of one whose inertia is that of motors' rotors. In the
palm's axes, the load w is the object's weight and what else acts on it, less the inertial forces of
the palm's acceleration (a, e) and rate of turning o:

    w = (m g, 0) + w_e - M_o (a, e) - (0, o x I o) - sum_i W_i m'_i b_i,                   (2)
    b_i = a + e x c_i + o x (o x c_i),

with the object's inertia I and the tips' centres c_i. The contact force on the object then changes
by

    -K_i d_i - C_i d_i' - m_i d_i'' - m'_i b_i,   d_i = W_i' x,                              (3)

and along axes that turn with the object by -t x f_i more. The whole load is scaled: the least
multiple at which a contact reaches its cone at any time is the predicted one. A trial whose
multiple is above one holds without slip. (1) is solved exactly for loads that are constant in each
sample.

A slip is not yet a loss. The object is predicted to be lost at the least multiple at which x passes
what is allowed, or at which the steady load with the x of the sample of first slip carries the
object away once contacts slip (see `beyond_slip`). A load that turns all the time makes contacts
slip in every round, and then the first slip counts instead.
"""

import importlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from grasp_core.arrays import Array, cross
from grasp_core.closure.contacts import cross_matrix, grasp_map
from grasp_core.execution.beyond_slip import loss_multiples
from grasp_core.execution.first_slip import slip_steps
from grasp_core.execution.grips import Grip
from grasp_core.solvers.ties import first_best
from scenes.mujoco.held import HeldLayout
from scenes.mujoco.held_mjcf import SAMPLE_S
from sim_validate.execution.paths import Drive

POSE = 6


@dataclass(frozen=True, slots=True, eq=False)
class HeldDynamics:
    """A held object as a mass on springs, by (1)."""

    grip: Grip
    layout: HeldLayout
    maps: Array
    """W_i, (k, 6, 3)."""
    own: Array
    """M_o, (6, 6) [kg, kg m^2]."""
    tips: Array
    """m_i, (k, 3, 3) [kg]."""
    carried: Array
    """Masses on which the acceleration of the fingers' bases acts, (k,) [kg]."""
    mass: Array
    """M, (6, 6) [kg, kg m, kg m^2]."""
    damping: Array
    """C, (6, 6) [N s/m, N s, N m s]."""
    dampers: Array
    """C_i, (k, 3, 3) [N s/m]."""

    @property
    def lowest_frequency(self) -> float:
        """Return the lowest natural frequency [rad/s], without damping; 0 if unstable."""
        inverse = np.linalg.inv(np.linalg.cholesky(self.mass))
        stiff = inverse @ self.grip.grasp_stiffness @ inverse.T
        return float(np.sqrt(max(np.linalg.eigvalsh(0.5 * (stiff + stiff.T))[0], 0.0)))


def held_dynamics(grip: Grip, layout: HeldLayout) -> HeldDynamics:
    """Build (1) for a grip and the masses and dampers of its scene."""
    maps = grasp_map(grip.arms).reshape(POSE, -1, 3).transpose(1, 0, 2)
    own = np.zeros((POSE, POSE))
    own[:3, :3] = layout.object_kg * np.eye(3)
    own[3:, 3:] = layout.inertia_kg_m2
    dampers = np.einsum("kij,kj,klj->kil", layout.axes, layout.damping, layout.axes)
    tips = np.einsum("kij,kj,klj->kil", layout.axes, layout.tip_masses, layout.axes)
    mass = own + np.einsum("kij,kjl,kml->im", maps, tips, maps)
    damping = np.einsum("kij,kjl,kml->im", maps, dampers, maps)
    return HeldDynamics(grip, layout, maps, own, tips, layout.tips_carried, mass, damping, dampers)


@dataclass(frozen=True, slots=True, eq=False)
class Expected:
    """The motion that a drive's load causes while no contact slips."""

    first_slip: float
    """Least multiple of the load at which a contact slips; infinite where none ever does."""
    slipping: Array
    """Motion x in the sample of the first slip, under the load at multiple one, (6,)."""
    moved_m: float
    turn_rad: float


def predicted_losses(
    dynamics: HeldDynamics, drives: Sequence[Drive], turning: Sequence[bool], most_m: float,
    most_rad: float,
) -> tuple[Array, Array]:  # fmt: skip
    """Return the multiples of each drive's load of the first slip, and of loss, (drives,) each.

    Both are zero where the grip is unstable at rest.
    """
    if not drives or not dynamics.grip.stable:
        return np.zeros(len(drives)), np.zeros(len(drives))
    found = expected(dynamics, drives)
    slips = np.array([each.first_slip for each in found])
    loads = np.array([each.slipping for each in found]) @ dynamics.grip.grasp_stiffness.T
    moved = np.array([max(each.moved_m / most_m, each.turn_rad / most_rad) for each in found])
    with np.errstate(divide="ignore"):
        sticking = 1.0 / moved
    beyond = np.maximum(slips, loss_multiples(dynamics.grip, loads, most_m, most_rad))
    return slips, np.minimum(sticking, np.where(turning, slips, beyond))


def expected(dynamics: HeldDynamics, drives: Sequence[Drive]) -> list[Expected]:
    """Solve (1) for each drive of a grip that is stable at rest."""
    if not drives:
        return []
    lengths = [len(drive) for drive in drives]
    loads = np.zeros((len(drives), max(lengths), POSE))
    bases = np.zeros((len(drives), max(lengths), *dynamics.layout.contacts.shape))
    for place, drive in enumerate(drives):
        loads[place, : len(drive)], bases[place, : len(drive)] = _load(dynamics, drive)
    grip, found = dynamics.grip, list[Expected]()
    for every, changes, count in zip(*_responses(dynamics, loads, bases), lengths, strict=True):
        rest, friction = np.tile(grip.local_squeeze, (count, 1)), np.tile(grip.friction, count)
        steps = slip_steps(rest, changes[:count].reshape(-1, 3), friction)
        slips, motion = steps.reshape(count, -1).min(axis=1), every[:count]
        found.append(
            Expected(
                first_slip=float(slips.min()),
                slipping=motion[first_best(-slips)],
                moved_m=float(np.linalg.norm(motion[:, :3], axis=1).max()),
                turn_rad=float(np.linalg.norm(motion[:, 3:], axis=1).max()),
            )
        )
    return found


def _load(dynamics: HeldDynamics, drive: Drive) -> tuple[Array, Array]:
    """Return w of (2), (n, 6), and the accelerations b_i, (n, k, 3), in the palm's axes.

    A table carries the object until its share of the load is one.
    """
    layout, turning = dynamics.layout, drive.accelerations[:, 3:]
    angles = SAMPLE_S * np.cumsum(SAMPLE_S * np.cumsum(turning, axis=0), axis=0)
    share = drive.shares if drive.table is not None else np.ones(len(drive))
    load = drive.wrenches.copy()
    load[:, :3] += _turned_back(layout.object_kg * share[:, None] * drive.gravity, angles)
    # the palm's rate of turning in the middle of each sample
    rates = SAMPLE_S * (np.cumsum(turning, axis=0) - 0.5 * turning)
    inwards = cross(rates[:, None], cross(rates[:, None], layout.tip_centers))
    sideways = cross(turning[:, None], layout.tip_centers)
    bases = drive.accelerations[:, None, :3] + sideways + inwards
    load -= drive.accelerations @ dynamics.own.T
    load[:, 3:] -= cross(rates, rates @ layout.inertia_kg_m2)
    load -= np.einsum("kij,k,nkj->ni", dynamics.maps, dynamics.carried, bases)
    return load, bases


def _turned_back(vectors: Array, angles: Array) -> Array:
    """Turn vectors (n, 3) back by the palm's angles (n, 3), which are about one axis at a time."""
    size = np.linalg.norm(angles, axis=1, keepdims=True)
    axis = angles / np.where(size > 0.0, size, 1.0)
    along = np.einsum("ni,ni->n", axis, vectors)[:, None] * axis
    turned = np.cos(size) * (vectors - along) - np.sin(size) * cross(axis, vectors) + along
    return np.where(size > 0.0, turned, vectors)


def _responses(dynamics: HeldDynamics, loads: Array, bases: Array) -> tuple[Array, Array]:
    """Return x, (drives, n, 6), and the contact forces' changes by (3), (drives, n, k, 3)."""
    grip = dynamics.grip
    motion, speed, acceleration = _solved(dynamics, loads)
    turned_maps = dynamics.maps.transpose(0, 2, 1)
    inertia = dynamics.tips @ turned_maps @ acceleration
    inertia += dynamics.carried[:, None, None] * bases[..., None]
    forces = -grip.force_changes @ motion + dynamics.dampers @ turned_maps @ speed
    turns = np.array([cross_matrix(force) for force in grip.squeeze])
    changes = turns @ motion[..., 3:, :] - forces - inertia
    return motion[:, :, 0, :, 0], np.einsum("kij,...kil->...kj", grip.frames, changes)


def _solved(dynamics: HeldDynamics, loads: Array) -> tuple[Array, Array, Array]:
    """Solve (1) from rest; return x, x' and x'' after each sample, (drives, n, 1, 6, 1) each."""
    linalg: Any = importlib.import_module("scipy.linalg")
    inverse = np.linalg.inv(dynamics.mass)
    stiff, damp = inverse @ dynamics.grip.grasp_stiffness, inverse @ dynamics.damping
    system = np.zeros((3 * POSE, 3 * POSE))
    system[:POSE, POSE : 2 * POSE] = np.eye(POSE)
    system[POSE : 2 * POSE] = np.hstack([-stiff, -damp, inverse])
    advanced: Array = linalg.expm(SAMPLE_S * system)[: 2 * POSE]
    step, gain = advanced[:, : 2 * POSE].T, advanced[:, 2 * POSE :].T
    states = np.zeros((*loads.shape[:2], 2 * POSE))
    pushed = loads @ gain
    state = np.zeros((len(loads), 2 * POSE))
    for sample in range(loads.shape[1]):
        state = state @ step + pushed[:, sample]
        states[:, sample] = state
    motion, speed = states[..., :POSE], states[..., POSE:]
    acceleration = loads @ inverse.T - motion @ stiff.T - speed @ damp.T
    return motion[..., None, :, None], speed[..., None, :, None], acceleration[..., None, :, None]
