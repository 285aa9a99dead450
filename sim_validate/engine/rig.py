"""An object that fingers squeeze without a load, and the trials that start from it.

Wrench holds, ramps and releases start from the squeezed object. The fingers squeeze while friction
is raised, so that the transients of loading cannot slip a contact that would hold at rest. In a
hold, the wrench and the forces planned for it are then applied together, the object settles,
friction is lowered to the value under test, and the object must stay where it is.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from grasp_core.arrays import Array
from scenes.mujoco.closure_scene import Layout, Scene
from sim_validate.engine.early_ends import EarlyEnds
from sim_validate.engine.held_or_let_go import Trace, traces
from sim_validate.engine.schedules import Schedule, Thresholds, TrialLoad, samples, smooth
from sim_validate.engine.setup import Setup
from sim_validate.engine.stepping import Bench, Motion


@dataclass(frozen=True, slots=True, eq=False)
class Watched:
    """The motion in one hold, from the closed fingers to the end."""

    joints: Array
    trace: Trace
    times_s: Array
    """Times of the samples, zero at the moment friction was lowered, (n,) [s]."""
    pushes_n: Array
    """Forces of the servos along the axes of the contacts, (n, k, 3) [N]."""
    friction: Array


@dataclass(frozen=True, slots=True, eq=False)
class Rig:
    """An object without load, squeezed by its fingers."""

    bench: Bench[Scene]
    setup: Setup
    friction: float
    """The friction at which the object is to be held."""
    idle: TrialLoad
    """The load without a wrench: only the forces that squeeze the object."""
    closed: Motion | None
    """The motion of the fingers while they closed; None for rigid fingers, which do not move."""
    settled: bool = False
    """Whether the object also settled in that motion, so that friction may be lowered at once."""
    whole: bool = False
    """Whether all trials have the protocols' full length; else each ends as soon as its answer is
    known (see `early_ends`)."""

    def holds(
        self, loads: Sequence[TrialLoad], settling_frictions: Sequence[float] | None = None
    ) -> list[Schedule]:
        """Schedule a hold under each load."""
        protocol, size = self.setup.hold, self.bench.scene.layout.grasp_size_m
        answer = Thresholds(protocol.hold_threshold * size, protocol.total_threshold * size)
        rise, rest, hold = self._counts(protocol.load_s, protocol.settle_s, protocol.hold_s)
        shares = np.concatenate([smooth(rise), np.ones(rest + hold)])
        usual = protocol.settling_friction * self.friction
        settling = settling_frictions or [usual] * len(loads)
        return [
            Schedule.between(
                self.idle, load, shares, (high, self.friction), rise + rest, rise, answer
            )
            for load, high in zip(loads, settling, strict=True)
        ]

    def ramps(
        self, limits: Sequence[TrialLoad], shares: tuple[float, float]
    ) -> tuple[list[Schedule], Array]:
        """Schedule a slow rise of each load from one share to another, loaded to it as in a hold.

        The forces balance the load all the way, whether the fingers can apply them or not. Gives
        also the share that is applied in each watched sample, (n,).
        """
        hold, (lower, upper) = self.setup.hold, shares
        rise, rest, count = self._counts(hold.load_s, hold.settle_s, self.setup.limit.ramp_s)
        climb = lower + (upper - lower) * np.arange(1, count + 1) / count
        applied = np.concatenate([lower * smooth(rise), np.full(rest, lower), climb])
        frictions, every = (hold.settling_friction * self.friction, self.friction), len(applied)
        return [
            Schedule.between(self.idle, limit, applied, frictions, rise + rest, every)
            for limit in limits
        ], climb

    def releases(
        self, settling_friction: float, frictions: Sequence[float], threshold_m: float | None = None
    ) -> list[Schedule]:
        """Schedule a fall of friction to several values on the unloaded object.

        A displacement of `threshold_m` ends a trial early.
        """
        answer = None if threshold_m is None else Thresholds(threshold_m)
        rest, hold = self._counts(self.setup.friction.settle_s, self.setup.friction.hold_s)
        rest *= not self.settled
        shares = np.ones(rest + hold)
        return [
            Schedule.between(
                self.idle, self.idle, shares, (settling_friction, friction), rest, 0, answer
            )
            for friction in frictions
        ]

    def at_rest(self, settling_friction: float) -> "Rig":
        """Let the unloaded object settle, so that it need not before each release."""
        assert self.closed is not None  # noqa: S101 - rigid fingers have not closed
        (count,) = self._counts(self.setup.friction.settle_s)
        frictions = settling_friction, settling_friction
        settling = Schedule.between(self.idle, self.idle, np.ones(count), frictions, count, 0)
        (motion,) = self._simulated([settling])
        return replace(self, closed=motion.after(self.closed), settled=True)

    def traced(self, trials: Sequence[Schedule]) -> tuple[Trace, ...]:
        """Simulate trials until each is answered, and trace them from when friction is lowered."""
        bench, closed, ends = self.bench, self.closed, None
        answer = trials[0].answer if trials else None
        if answer is not None and not self.whole:
            at = None if closed is None or not len(closed.joints) else closed.joints[-1]
            ends = EarlyEnds(bench.scene.layout, trials, bench.sample_s, answer, at)
        return self._traces(trials, self._simulated(trials, ends))

    def watch(self, trial: Schedule) -> Watched:
        """Simulate one whole trial, and keep all motion since the fingers closed."""
        (motion,) = self._simulated([trial])
        (found,) = self._traces([trial], [motion])
        before = [] if self.closed is None else [self.closed.joints[-1:]]
        count = len(motion.joints)
        return Watched(
            joints=np.concatenate([*before, motion.joints]),
            trace=found,
            times_s=self.bench.sample_s
            * np.arange(1.0 - trial.watched, count + 1.0 - trial.watched),
            pushes_n=pushes(trial.forces[:count], motion.joints, self.bench.scene.layout),
            friction=trial.friction[:count],
        )

    def joints(self, trials: Sequence[Schedule]) -> Array:
        """Return joint positions in whole trials, from closed fingers on, (trials, n, 7 + 3k)."""
        return np.array([motion.joints for motion in self._simulated(trials)])

    def _counts(self, *durations_s: float) -> list[int]:
        return [samples(duration_s, self.bench.sample_s) for duration_s in durations_s]

    def _simulated(
        self, trials: Sequence[Schedule], ends: EarlyEnds | None = None
    ) -> tuple[Motion, ...]:
        told = [trial.told(self.bench.scene.layout) for trial in trials]
        start = self.closed and self.closed.state
        if ends is None:
            return self.bench.simulated(told, start)
        return self.bench.simulated(told, start, ends.following, ends.earliest)

    def _traces(self, trials: Sequence[Schedule], motions: Sequence[Motion]) -> tuple[Trace, ...]:
        closed = self.closed
        whole = motions if closed is None else [motion.after(closed) for motion in motions]
        watched = [
            trial.watched - motion.skipped for trial, motion in zip(trials, motions, strict=True)
        ]
        return traces(whole, self.bench.scene.layout, watched, closed if self.settled else None)


def pushes(planned: Array, joints: Array, layout: Layout) -> Array:
    """Compute forces of servos, (n, k, 3) [N]: the planned ones, less what their springs gave way.

    They are along the axes of the contacts, and at rest they are the contact forces.
    """
    local = np.einsum("kij,nki->nkj", layout.frames, planned)
    forces = local - layout.drive.stiffness_n_per_m * joints[:, 7:].reshape(local.shape)
    forces[..., 0] = np.clip(forces[..., 0], 0.0, layout.drive.max_normal_force_n)
    return forces


def squeezed(
    bench: Bench[Scene], setup: Setup, forces: Array, friction: float,
    settling_friction: float | None = None,
) -> Rig:  # fmt: skip
    """Close the fingers of a compiled scene on the unloaded object."""
    high = settling_friction or setup.hold.settling_friction * friction
    opened, idle = TrialLoad(np.zeros(6), np.zeros_like(forces)), TrialLoad(np.zeros(6), forces)
    shares = smooth(samples(setup.hold.squeeze_s, bench.sample_s))
    closing = Schedule.between(opened, idle, shares, (high, high), len(shares), len(shares))
    (closed,) = bench.simulated([closing.told(bench.scene.layout)])
    return Rig(bench, setup, friction, idle, closed)


def closed_on(
    scene: Scene, setup: Setup, friction: float, settling_friction: float | None = None
) -> Rig:
    """Close the fingers of a scene on the unloaded object, with the squeeze of its layout."""
    bench = Bench(scene, threads=setup.threads, timeout_s=setup.timeout_s)
    return squeezed(bench, setup, scene.layout.squeeze_forces, friction, settling_friction)
