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
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from grasp_core.arrays import Array, cross
from grasp_core.closure.contacts import WRENCH, cross_matrix
from grasp_core.execution.beyond_slip import loss_multiples
from grasp_core.execution.first_slip import slip_steps
from grasp_core.execution.grips import Grip
from grasp_core.solvers.ties import first_best
from scenes.mujoco.held_scene import SAMPLE_S, HeldLayout
from scenes.mujoco.mjcf_text import rotations
from sim_validate.execution.paths import TrialDrive
from sim_validate.execution.trials import Trial
from sim_validate.settings import ExecutionSettings


@dataclass(frozen=True, slots=True, eq=False)
class Expected:
    """The motion that a drive's load causes while no contact slips."""

    first_slip: float
    """Least multiple of the load at which a contact slips; infinite where none ever does."""
    slipping: Array
    """Motion x in the sample of the first slip, under the load at multiple one, (6,)."""
    moved_m: float
    turn_rad: float


class HeldDynamics:
    """A held object as a mass on springs, by (1)."""

    def __init__(self, grip: Grip, layout: HeldLayout) -> None:
        self.grip, self.layout, axes = grip, layout, layout.axes
        self.dampers: Array = np.einsum("kij,kj,klj->kil", axes, layout.damping, axes)  # C_i
        self.tips: Array = np.einsum("kij,kj,klj->kil", axes, layout.tip_masses, axes)  # m_i
        self.own = np.zeros((WRENCH, WRENCH))  # M_o
        self.own[:3, :3] = layout.object_kg * np.eye(3)
        self.own[3:, 3:] = layout.inertia_kg_m2
        # M and C
        self.mass: Array = self.own + np.einsum("kij,kjl,kml->im", grip.maps, self.tips, grip.maps)
        self.damping: Array = np.einsum("kij,kjl,kml->im", grip.maps, self.dampers, grip.maps)

    @property
    def lowest_frequency(self) -> float:
        """Return the lowest natural frequency [rad/s], without damping; 0 if unstable."""
        inverse = np.linalg.inv(np.linalg.cholesky(self.mass))
        stiff = inverse @ self.grip.grasp_stiffness @ inverse.T
        return float(np.sqrt(max(np.linalg.eigvalsh(0.5 * (stiff + stiff.T))[0], 0.0)))

    def losses(
        self, trials: Sequence[Trial], settings: ExecutionSettings
    ) -> list[tuple[float, float]]:
        """Return the multiples of each trial's load of the first slip, and of loss."""
        if not trials or not self.grip.stable:
            return [(0.0, 0.0)] * len(trials)
        most_m, most_rad = settings.most_m, settings.most_rad
        found = self.expected([trial.expected or trial.drive for trial in trials])
        slips = np.array([each.first_slip for each in found])
        loads = np.array([each.slipping for each in found]) @ self.grip.grasp_stiffness.T
        moved = np.array([max(each.moved_m / most_m, each.turn_rad / most_rad) for each in found])
        with np.errstate(divide="ignore"):
            sticking = 1.0 / moved
        beyond, once = slips.copy(), np.array([not trial.turning for trial in trials])
        own, places = np.unique(loads[once], axis=0, return_inverse=True)
        multiples = loss_multiples(self.grip, own, most_m, most_rad)[places]
        beyond[once] = np.maximum(slips[once], multiples)
        losses = np.minimum(sticking, beyond)
        return list(zip(slips.tolist(), losses.tolist(), strict=True))

    def expected(self, drives: Sequence[TrialDrive]) -> list[Expected]:
        """Solve (1) for each drive of a grip that is stable at rest."""
        alike = dict[int, list[TrialDrive]]()
        for drive in dict.fromkeys(drives):  # several trials may expect the same
            alike.setdefault(len(drive), []).append(drive)
        grip, found = self.grip, dict[TrialDrive, Expected]()
        for own in alike.values():
            loads, bases = map(np.array, zip(*map(self._load, own), strict=True))
            for drive, motion, changes in zip(own, *self._responses(loads, bases), strict=True):
                slips = slip_steps(grip.local_squeeze, changes, grip.friction).min(axis=1)
                found[drive] = Expected(
                    first_slip=float(slips.min()),
                    slipping=motion[first_best(-slips)],
                    moved_m=float(np.linalg.norm(motion[:, :3], axis=1).max()),
                    turn_rad=float(np.linalg.norm(motion[:, 3:], axis=1).max()),
                )
        return [found[drive] for drive in drives]

    def _load(self, drive: TrialDrive) -> tuple[Array, Array]:
        """Return w of (2), (n, 6), and the accelerations b_i, (n, k, 3), in the palm's axes."""
        layout, turning = self.layout, drive.accelerations[:, 3:]
        angles = SAMPLE_S * np.cumsum(SAMPLE_S * np.cumsum(turning, axis=0), axis=0)
        # a table carries the object until its share of the load is one
        share = drive.shares if drive.table is not None else np.ones(len(drive))
        load = drive.wrenches.copy()
        # the palm's angles are about one axis at a time
        half = 0.5 * np.linalg.norm(angles, axis=1, keepdims=True)
        turns = rotations(np.hstack([np.cos(half), 0.5 * np.sinc(half / math.pi) * angles]))
        weight = layout.object_kg * share[:, None] * drive.gravity
        load[:, :3] += np.einsum("nji,nj->ni", turns, weight)
        # the palm's rate of turning in the middle of each sample
        rates = SAMPLE_S * (np.cumsum(turning, axis=0) - 0.5 * turning)
        inwards = cross(rates[:, None], cross(rates[:, None], layout.tip_centers))
        sideways = cross(turning[:, None], layout.tip_centers)
        bases = drive.accelerations[:, None, :3] + sideways + inwards
        load -= drive.accelerations @ self.own.T
        load[:, 3:] -= cross(rates, rates @ layout.inertia_kg_m2)
        load -= np.einsum("kij,k,nkj->ni", self.grip.maps, layout.tips_carried, bases)
        return load, bases

    def _responses(self, loads: Array, bases: Array) -> tuple[Array, Array]:
        """Return x, (drives, n, 6), and the contact forces' changes by (3), (drives, n, k, 3)."""
        grip, turned_maps = self.grip, self.grip.maps.transpose(0, 2, 1)
        motion, speed, acceleration = self._solved(loads)
        inertia = self.tips @ turned_maps @ acceleration
        inertia += self.layout.tips_carried[:, None, None] * bases[..., None]
        forces = -grip.force_changes @ motion + self.dampers @ turned_maps @ speed
        turns = np.array([cross_matrix(force) for force in grip.squeeze])
        changes = turns @ motion[..., 3:, :] - forces - inertia
        return motion[:, :, 0, :, 0], np.einsum("kij,...kil->...kj", grip.frames, changes)

    @cached_property
    def _advance(self) -> tuple[Array, Array, Array]:
        """What takes (x, x') through a sample, and what a load adds to them, by (1); M^-1."""
        linalg: Any = importlib.import_module("scipy.linalg")
        inverse = np.asarray(np.linalg.inv(self.mass), dtype=np.float64)
        stiff, damp = inverse @ self.grip.grasp_stiffness, inverse @ self.damping
        system = np.zeros((3 * WRENCH, 3 * WRENCH))
        system[:WRENCH, WRENCH : 2 * WRENCH] = np.eye(WRENCH)
        system[WRENCH : 2 * WRENCH] = np.hstack([-stiff, -damp, inverse])
        advanced: Array = linalg.expm(SAMPLE_S * system)[: 2 * WRENCH]
        return advanced[:, : 2 * WRENCH].T, advanced[:, 2 * WRENCH :].T, inverse

    def _solved(self, loads: Array) -> Array:
        """Solve (1) from rest; return x, x' and x'' after each sample, (3, drives, n, 1, 6, 1)."""
        step, gain, inverse = self._advance
        stiff, damp = inverse @ self.grip.grasp_stiffness, inverse @ self.damping
        states = np.zeros((*loads.shape[:2], 2 * WRENCH))
        pushed = loads @ gain
        state = np.zeros((len(loads), 2 * WRENCH))
        for sample in range(loads.shape[1]):
            state = state @ step + pushed[:, sample]
            states[:, sample] = state
        motion, speed = states[..., :WRENCH], states[..., WRENCH:]
        acceleration = loads @ inverse.T - motion @ stiff.T - speed @ damp.T
        return np.stack([motion, speed, acceleration])[..., None, :, None]
