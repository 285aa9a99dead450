"""Holds an object between squeezing fingers; wrench holds, ramps and releases start from there."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from grasp_core.arrays import Array
from scenes.mujoco.closure_scene import Scene
from scenes.mujoco.layout import Layout
from sim_validate.engine.bench import Bench, Load, Motion, Schedule
from sim_validate.engine.setup import Setup
from sim_validate.engine.traces import EarlyEnds, Thresholds, Trace, traces


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

    bench: Bench
    setup: Setup
    friction: float
    """The friction at which the object is to be held."""
    idle: Load
    """The load without a wrench: only the forces that squeeze the object."""
    closed: Motion | None
    """The motion of the fingers while they closed; None for rigid fingers, which do not move."""
    settled: bool = False
    """Whether the object also settled in that motion, so that friction may be lowered at once."""
    whole: bool = False
    """Whether all trials have the protocols' full length; else each ends as soon as its answer is
    known (see `traces`)."""

    def hold(
        self, loads: Sequence[Load], settling_frictions: Sequence[float] | None = None
    ) -> tuple[Trace, ...]:
        """Simulate a hold under each load, and trace it from the moment friction is lowered."""
        protocol, size = self.setup.hold, self.bench.scene.layout.grasp_size_m
        limits = Thresholds(protocol.hold_threshold * size, protocol.total_threshold * size)
        return self._traces(self.holds(loads, settling_frictions), limits)

    def watch(self, load: Load, settling_frictions: Sequence[float] | None = None) -> Watched:
        """Simulate one whole hold, and keep all motion since the fingers closed."""
        (schedule,) = self.holds([load], settling_frictions)
        (motion,) = self.bench.run([schedule], self.closed and self.closed.state)
        (found,) = self._traced([schedule], [motion])
        before = [] if self.closed is None else [self.closed.joints[-1:]]
        count = len(motion.joints)
        return Watched(
            joints=np.concatenate([*before, motion.joints]),
            trace=found,
            times_s=self.bench.sample_s
            * np.arange(1.0 - schedule.watched, count + 1.0 - schedule.watched),
            pushes_n=pushes(schedule.forces[:count], motion.joints, self.bench.scene.layout),
            friction=schedule.friction[:count],
        )

    def holds(
        self, loads: Sequence[Load], settling_frictions: Sequence[float] | None = None
    ) -> list[Schedule]:
        """Schedule a hold under each load."""
        protocol = self.setup.hold
        usual = protocol.settling_friction * self.friction
        settling = settling_frictions or [usual] * len(loads)
        return [
            Schedule.hold(self.idle, load, (high, self.friction), self.bench.sample_s, protocol)
            for load, high in zip(loads, settling, strict=True)
        ]

    def ramp(
        self, limits: Sequence[Load], shares: tuple[float, float]
    ) -> tuple[tuple[Trace, ...], Array]:
        """Raise each load between two shares of itself; return the motions and the shares (n,)."""
        sample_s, protocols = self.bench.sample_s, (self.setup.hold, self.setup.limit)
        rises = [
            Schedule.ramp(self.idle, load, shares, self.friction, sample_s, protocols)
            for load in limits
        ]
        return self._traces([schedule for schedule, _ in rises]), rises[0][1]

    def at_rest(self, settling_friction: float) -> "Rig":
        """Let the unloaded object settle, so that it need not before each release."""
        assert self.closed is not None  # noqa: S101 - rigid fingers have not closed
        protocol = self.setup.friction
        trial = Schedule.settle(self.idle, settling_friction, self.bench.sample_s, protocol)
        (motion,) = self.bench.run([trial], self.closed.state)
        return replace(self, closed=motion.after(self.closed), settled=True)

    def release(
        self, settling_friction: float, frictions: Sequence[float], threshold_m: float | None = None
    ) -> tuple[Trace, ...]:
        """Lower the friction of the unloaded object to several values, and trace its motion."""
        limits = None if threshold_m is None else Thresholds(threshold_m)
        return self._traces(self.releases(settling_friction, frictions), limits)

    def releases(self, settling_friction: float, frictions: Sequence[float]) -> list[Schedule]:
        """Schedule a release to each friction."""
        sample_s, protocol = self.bench.sample_s, self.setup.friction
        return [
            Schedule.release(self.idle, (settling_friction, friction), sample_s, protocol,
                              settled=self.settled)
            for friction in frictions
        ]  # fmt: skip

    def joints(self, trials: Sequence[Schedule]) -> Array:
        """Return joint positions in trials, from closed fingers on, (trials, n, 7 + 3k)."""
        motions = self.bench.run(trials, self.closed and self.closed.state)
        return np.array([motion.joints for motion in motions])

    def _traces(
        self, trials: Sequence[Schedule], limits: Thresholds | None = None
    ) -> tuple[Trace, ...]:
        bench, ends, closed = self.bench, None, self.closed
        if limits is not None and not self.whole:
            at = None if closed is None or not len(closed.joints) else closed.joints[-1]
            ends = EarlyEnds(bench.scene.layout, trials, bench.sample_s, limits, at)
        return self._traced(trials, bench.run(trials, closed and closed.state, ends))

    def _traced(self, trials: Sequence[Schedule], motions: Sequence[Motion]) -> tuple[Trace, ...]:
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
    bench: Bench, setup: Setup, forces: Array, friction: float,
    settling_friction: float | None = None,
) -> Rig:  # fmt: skip
    """Close the fingers of a compiled scene on the unloaded object."""
    high = settling_friction or setup.hold.settling_friction * friction
    (closed,) = bench.run([Schedule.squeeze(forces, high, bench.sample_s, setup.hold)])
    return Rig(bench, setup, friction, Load(np.zeros(6), forces), closed)


def closed_on(
    scene: Scene, setup: Setup, friction: float, settling_friction: float | None = None
) -> Rig:
    """Close the fingers of a scene on the unloaded object, with the squeeze of its layout."""
    bench = Bench(scene, threads=setup.threads, timeout_s=setup.timeout_s)
    return squeezed(bench, setup, scene.layout.squeeze_forces, friction, settling_friction)
