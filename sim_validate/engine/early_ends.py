"""Ends trials whose answer is known: those that are lost, and those that have settled.

Lost. A trial asks whether displacements and gaps stay below thresholds. The first sample in which a
displacement does not answers it: nothing that comes later can make that sample undone. That is
certain loss, and it is the same sample by which the trial is judged.

Settled. A trial is answered as held where what is still to come is bounded. From some sample on,
load, forces of the servos and friction are constant. Let x be the motion of object and fingertips.
While every contact stays closed and inside its friction cone, fingertips stick to the object (up to
creep, below), and x is the motion of one rigid assembly on the springs of its k fingertips: masses
M, stiffness K and dampers G. Springs and dampers sit at the same fingertips, alike in all
directions, so G = (g / s) K for dampers g and springs s. A constant load has a potential, so

    E = x'M x' / 2 + e K e / 2,    e = x - x*,                                           (1)

never grows about the equilibrium x*, and the equation of motion M x'' + G x' + K e = 0 gives e from
what is measured. With w0^2 = k s / (object's mass + masses of k fingertips), the least square of a
natural frequency (about any axis the contacts' root mean square lever is at least the grasp size,
and the object's inertia a quarter of its mass times the square of that, so turning is no slower),

    |e|_K <= |x''|_M / w0 + (g / s) |x'|_K.                                              (2)

e K e is s times the sum of squares of the tips' ways to their equilibrium. So no fingertip is or
gets farther from its equilibrium than B = sqrt(2 E / s), and the object, whose shift and size times
turn have at most sqrt(2 / k) of it, moves by 2 sqrt(2 / k) B at most from here on.              (3)

Contact forces are those of the servos less the tips' inertia. With w = sqrt(s / m) for a tip's mass
m, speeds are at most w B, so forces stay within s B + g w B + m (w^2 B + (g / m) w B) of those at
equilibrium: (2 + 2 g / sqrt(s m)) s B, now and later.                                           (4)

The simulator's friction is not quite rigid: contacts inside their cones creep, at speeds that are
proportional to the forces and so constant at rest. Creep hides in measured speeds, which differ
from it by the speed of the transient, at most w B. So it is at most the measured speed plus that,
for the time that is left, and tips carry it into the springs.                                   (5)

If contacts are deeper in their cones, and servos farther from their limits, than (4) twice and (5)
together, then no contact ever slips or opens, so (1) to (5) hold to the end. Both bounds are
doubled for what the linear model leaves out (forces that turn with the object weaken springs by up
to a fifth; the acceleration is a mean over the last sample), and they may use up half of a
threshold. Contacts near the border of their cones never meet this: their trials run on. Rigid
fingertips have no springs, contacts nearly on one line have levers shorter than the grasp size
that scenes take, and the torques of soft contacts do not show in the servos, so there trials end
early only by loss.

The same bound tells when an object has settled at high friction before it is lowered.
"""

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array, Indices
from grasp_core.closure.contacts import cross_matrix
from scenes.mujoco.closure_scene import Layout, grasp_size
from scenes.mujoco.mjcf_text import IDENTITY_POSE
from sim_validate.engine.held_or_let_go import displaced, lengths_of, strayed
from sim_validate.engine.schedules import Schedule, Thresholds

Mask: TypeAlias = NDArray[np.bool_]

SAFETY = 2.0
"""Factor on bounds of motions and forces, for what the linear model leaves out."""
USABLE = 0.5
"""Largest share of a threshold that an object may use up, bounds included, to count as held."""
SETTLED_MOTION = 0.01
"""Bound of the motion to come, relative to the threshold, at which an object has settled before
friction is lowered. The servos' forces are then within some 1e-4 of those at rest, in largest
normal forces, which is less than thresholds let pass."""
LEAST_WATCHED_SAMPLES = 3
"""Least number of samples for which an object is watched after friction was lowered. A contact that
must slip begins to in the first step."""
SIZE_SLACK = 1e-6
"""Difference of two sizes that is rounding, relative to them."""


class EarlyEnds:
    """Looks at the trials of a scene sample by sample, and tells which of them may end."""

    def __init__(
        self, layout: Layout, trials: Sequence[Schedule], sample_s: float, thresholds: Thresholds,
        start: Array | None = None,
    ) -> None:  # fmt: skip
        self.layout, self.thresholds, self.sample_s = layout, thresholds, sample_s
        self.resting = np.array([trial.resting for trial in trials])
        self.watched = np.array([trial.watched for trial in trials])
        # speeds of the sample before give the first acceleration under a constant load
        self.earliest = int(self.resting.min()) - 1
        self.frictions = np.array([trial.friction for trial in trials])
        pushes = np.array([trial.forces[-1] for trial in trials])
        self.commands = np.einsum("kij,nki->nkj", layout.frames, pushes).reshape(len(trials), -1)
        at = IDENTITY_POSE if start is None else start[:7]
        self.starts = np.tile(at, (len(trials), 1))
        self.began_m = np.full(len(trials), strayed(at[None], layout)[0])
        self.springs = _sticking_model(layout)
        # |x'|_M of the look before; there is none before the first
        self.momenta: Array | None = None
        # a turn is at most 2.25 times the length of the difference of two quaternions
        self.lever = 2.25 * (float(np.linalg.norm(layout.center)) + layout.grasp_size_m)

    def following(self, places: Indices, samples: Indices, joints: Array, speeds: Array) -> Indices:
        """Give the sample after one for each trial that goes on (see `Bench.simulated`)."""
        after = samples + 1
        if samples.min() >= self.earliest:
            settled, answered = self.look(places, samples, joints[places], speeds[places])
            after = np.where(settled, self.watched[places], after)
            after[answered] = self.frictions.shape[1]
        return after

    def look(
        self, places: Indices, samples: Indices, joints: Array, speeds: Array
    ) -> tuple[Mask, Mask]:
        """Tell from joints (n, 7 + 3k) and speeds (n, 6 + 3k) which trials go on.

        Gives those that need not settle any longer, and those that are answered, (n,) each.
        """
        settled = answered = np.zeros(len(places), dtype=np.bool_)
        with np.errstate(all="ignore"):  # what diverges is neither settled nor answered
            reach = self._reach(places, speeds)
            after = samples >= self.watched[places]
            if not after.all():
                settled = ~after & self._settled(places, samples, joints, speeds, reach)
                # from where objects must not move, in case friction is lowered next
                self.starts[places[~after]] = joints[~after, :7]
                self.began_m[places[~after]] = np.nan
            if after.any():
                answered = after & self._answered(places, samples, joints, speeds, reach)
        return settled, answered

    def _reach(self, places: Indices, speeds: Array) -> Array | None:
        """Bound the way of each tip to its equilibrium: B of (3), (n,) [m]; None if unknown."""
        if self.springs is None:
            return None
        # not by BLAS, whose last digits depend on how many trials there are
        momenta = np.einsum("ni,ij->nj", speeds, self.springs.roots)
        before = self.momenta
        # NaN where a trial was not looked at, which ends nothing
        self.momenta = np.full((len(self.watched), speeds.shape[1]), np.nan)
        self.momenta[places] = momenta
        if before is None:
            return None
        gained = lengths_of(momenta - before[places]) / self.sample_s
        return self.springs.reach(lengths_of(momenta), gained, lengths_of(speeds[:, 6:]))

    def _settled(
        self, places: Indices, samples: Indices, joints: Array, speeds: Array, reach: Array | None
    ) -> Mask:
        """Tell whether nothing that counts can come while friction is high, (n,)."""
        if self.springs is None or reach is None:
            return np.zeros(len(places), dtype=np.bool_)
        calm = self.springs.further(reach) <= SETTLED_MOTION * self.thresholds.watched_m
        calm &= samples >= self.resting[places]
        if calm.any():
            friction = self.frictions[places, samples]
            calm &= self.springs.stuck(self.commands[places], friction, joints, speeds, reach, 0.0)
        return calm

    def _answered(
        self, places: Indices, samples: Indices, joints: Array, speeds: Array, reach: Array | None
    ) -> Mask:
        """Tell whether trials are lost, or held whatever is still to come, (n,)."""
        limits, springs, starts = self.thresholds, self.springs, self.starts[places]
        if np.isnan(self.began_m[places]).any():
            self.began_m[places] = strayed(starts, self.layout)
        began = self.began_m[places]
        away = joints[:, :7] - starts
        most = lengths_of(away[:, :3]) + self.lever * lengths_of(away[:, 3:])
        lost = np.zeros(len(places), dtype=np.bool_)
        # alone and beside others a trial must end alike, so only what may be lost is measured
        near = ~(np.maximum(most / limits.watched_m, (began + most) / limits.total_m) < 1.0)
        if near.any():
            moved = displaced(joints[near, :7], starts[near], self.layout)
            lost[near] = (moved >= limits.watched_m) | (began[near] + moved >= limits.total_m)
        seen = samples - self.watched[places] + 1 >= LEAST_WATCHED_SAMPLES
        if springs is None or reach is None or not seen.any():
            return lost
        left_s = self.sample_s * (self.frictions.shape[1] - 1 - samples)
        most = most + springs.further(reach) + SAFETY * left_s * springs.creep(speeds, reach)
        held = np.maximum(most / limits.watched_m, (began + most) / limits.total_m) <= USABLE
        held &= seen
        if held.any():
            friction = self.frictions[places, -1]
            commands = self.commands[places]
            held &= springs.stuck(commands, friction, joints, speeds, reach, left_s)
        return lost | held


class StickingModel:
    """The linear model of an object that sticks to its fingertips."""

    def __init__(self, layout: Layout) -> None:
        drive, count = layout.drive, len(layout.contacts)
        self.spring, self.damper = drive.stiffness_n_per_m, drive.damping_n_s_per_m
        self.size, self.largest = layout.grasp_size_m, drive.max_normal_force_n
        self.share = math.sqrt(2.0 / count)
        moving = layout.object_kg + count * drive.tip_mass_kg
        self.slowest = math.sqrt(count * self.spring / moving)
        self.fastest = math.sqrt(self.spring / drive.tip_mass_kg)
        self.forces = 2.0 + 2.0 * self.damper / math.sqrt(self.spring * drive.tip_mass_kg)
        # angular velocity times this is how fast the simulated centre of mass moves with it
        arm = cross_matrix(layout.center)
        self.arms = np.block([[np.eye(3), np.zeros((3, 3))], [arm, self.size * np.eye(3)]])
        # speeds times these have the length |x'|_M
        roots = np.eye(6 + 3 * count) * math.sqrt(drive.tip_mass_kg)
        roots[:3, :3] = np.eye(3) * math.sqrt(layout.object_kg)
        roots[3:6, :3] = math.sqrt(layout.object_kg) * arm
        roots[3:6, 3:6] = np.linalg.cholesky(layout.inertia_kg_m2)
        self.roots = roots

    def reach(self, moving: Array, gaining: Array, tips: Array) -> Array:
        """Compute B of (3) from |x'|_M, |x''|_M and the length of all tips' velocities."""
        away = gaining / self.slowest + self.damper / math.sqrt(self.spring) * tips
        return np.sqrt((moving**2 + away**2) / self.spring)

    def further(self, reach: Array) -> Array:
        """Bound the motion of the object that transients can still cause, (3), (n,) [m]."""
        return SAFETY * 2.0 * self.share * reach

    def creep(self, speeds: Array, reach: Array) -> Array:
        """Bound the speed with which the object creeps, (5), (n,) [m/s]."""
        moving = np.einsum("ni,ij->nj", speeds[:, :6], self.arms)
        measured = lengths_of(moving[:, :3]) + lengths_of(moving[:, 3:])
        return measured + self.share * self.fastest * reach

    def stuck(
        self, commands: Array, friction: Array, joints: Array, speeds: Array, reach: Array,
        left_s: Array | float,
    ) -> Mask:  # fmt: skip
        """Tell whether all contacts stay inside the cones of a friction for a time, (n,)."""
        pushes = commands - self.spring * joints[:, 7:] - self.damper * speeds[:, 6:]
        pushes = pushes.reshape(len(pushes), -1, 3)
        crept = left_s * (lengths_of(speeds[:, 6:]) + self.fastest * reach)
        change = (SAFETY * self.spring * (2.0 * self.forces * reach + crept))[:, None]
        normal, across = pushes[..., 0], np.hypot(pushes[..., 1], pushes[..., 2])
        slope = friction[:, None]
        inside = slope * normal - across > (1.0 + slope) * change
        good: Mask = inside & (normal > change) & (normal < self.largest - change)
        return np.logical_and.reduce(good, axis=1)


@lru_cache(maxsize=4)
def _sticking_model(layout: Layout) -> StickingModel | None:
    """Return the linear model of a layout; None where it would not bound the motion."""
    # contacts must be hard, and as far from their closest axis as the layout's grasp size
    if not layout.has_springs or layout.softness.is_soft:
        return None
    if grasp_size(layout.contacts) < layout.grasp_size_m * (1.0 - SIZE_SLACK):
        return None
    return StickingModel(layout)
