"""An object squeezed on the bench: from there the wrench holds, ramps and releases start."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array
from scenes.layout import Layout
from sim_validate.simulation import schedules
from sim_validate.simulation.schedules import Load, Schedule
from sim_validate.simulation.setup import Setup
from sim_validate.simulation.simulate import Bench, Motion
from sim_validate.simulation.traces import Trace, trace


@dataclass(frozen=True, slots=True, eq=False)
class Watched:
    """One hold from the closed fingers to its end."""

    joints: Array
    """As in `Motion`, (n, 7 + 3k)."""
    trace: Trace
    """From the moment friction was lowered."""
    times_s: Array
    """Of the samples before and after that moment, which is at zero, (n,)."""
    pushes_n: Array
    """What each fingertip's servos push with, along the axes of its contact, (n, k, 3)."""
    friction: Array
    """In each sample, (n,)."""


@dataclass(frozen=True, slots=True, eq=False)
class Rig:
    """An object in the grip of its fingers, unloaded."""

    bench: Bench
    setup: Setup
    friction: float
    """At which it is to be held."""
    idle: Load
    """No wrench, and the forces that squeeze it."""
    closed: Motion | None
    """How the fingers closed; None for rigid ones, which are put where they are."""

    def hold(
        self, loads: Sequence[Load], settling_frictions: Sequence[float] | None = None
    ) -> tuple[Trace, ...]:
        """Motion under each load, from the moment friction is lowered.

        Args:
            loads: What to hold.
            settling_frictions: Friction until then, one for each load; a multiple of that to hold
                at if None.
        """
        return self._traces(self._holds(loads, settling_frictions))

    def watch(self, load: Load, settling_friction: float | None = None) -> Watched:
        """One load, held as above, with all that moved since the fingers closed."""
        settling = None if settling_friction is None else [settling_friction]
        (schedule,) = self._holds([load], settling)
        (motion,) = self.bench.run([schedule], self.closed and self.closed.state)
        (found,) = self._traced([schedule], [motion])
        before = [] if self.closed is None else [self.closed.joints[-1:]]
        count = len(motion.joints)
        return Watched(
            joints=np.concatenate([*before, motion.joints]),
            trace=found,
            times_s=self.bench.clock.sample_s
            * np.arange(1.0 - schedule.watched, count + 1.0 - schedule.watched),
            pushes_n=pushes(schedule.forces[:count], motion.joints, self.bench.scene.layout),
            friction=schedule.friction[:count],
        )

    def _holds(
        self, loads: Sequence[Load], settling_frictions: Sequence[float] | None
    ) -> list[Schedule]:
        protocol, clock = self.setup.hold, self.bench.clock
        usual = protocol.settling_friction * self.friction
        settling = settling_frictions or [usual] * len(loads)
        return [
            schedules.hold(self.idle, load, (high, self.friction), clock, protocol)
            for load, high in zip(loads, settling, strict=True)
        ]

    def ramp(
        self, limits: Sequence[Load], shares: tuple[float, float]
    ) -> tuple[tuple[Trace, ...], Array]:
        """Motion while each load rises between two shares of itself, and the shares (n,)."""
        clock, protocols = self.bench.clock, (self.setup.hold, self.setup.limit)
        rises = [
            schedules.ramp(self.idle, load, shares, self.friction, clock, protocols)
            for load in limits
        ]
        return self._traces([schedule for schedule, _ in rises]), rises[0][1]

    def release(self, settling_friction: float, frictions: Sequence[float]) -> tuple[Trace, ...]:
        """Motion of the unloaded object after friction is lowered to each of several values."""
        return self._traces(self._releases(settling_friction, frictions))

    def _releases(self, settling_friction: float, frictions: Sequence[float]) -> list[Schedule]:
        clock, protocol = self.bench.clock, self.setup.friction
        return [
            schedules.release(self.idle.forces, settling_friction, friction, clock, protocol)
            for friction in frictions
        ]

    def motions_of_holds(self, loads: Sequence[Load]) -> Array:
        """Joint positions under each load, from the closed fingers on, (trials, n, 7 + 3k)."""
        return self._joints(self._holds(loads, None))

    def motions_of_releases(self, settling_friction: float, frictions: Sequence[float]) -> Array:
        """The same, of the unloaded object after friction is lowered to each of several values."""
        return self._joints(self._releases(settling_friction, frictions))

    def _joints(self, trials: Sequence[Schedule]) -> Array:
        motions = self.bench.run(trials, self.closed and self.closed.state)
        return np.array([motion.joints for motion in motions])

    def _traces(self, trials: Sequence[Schedule]) -> tuple[Trace, ...]:
        return self._traced(trials, self.bench.run(trials, self.closed and self.closed.state))

    def _traced(self, trials: Sequence[Schedule], motions: Sequence[Motion]) -> tuple[Trace, ...]:
        layout = self.bench.scene.layout
        return tuple(
            trace(motion.after(self.closed) if self.closed else motion, layout, trial.watched)
            for motion, trial in zip(motions, trials, strict=True)
        )


def pushes(planned: Array, joints: Array, layout: Layout) -> Array:
    """What the servos push fingertips with: the planned forces, less what their springs gave way.

    Args:
        planned: Forces that the fingers are told to apply, (n, k, 3) [N], world axes.
        joints: As in `Motion`, (n, 7 + 3k) [m].
        layout: Of the scene, with fingertips on slides.

    Returns:
        Along the axes of the contacts, (n, k, 3) [N]. At rest, the contact forces.
    """
    local = np.einsum("kij,nki->nkj", layout.frames, planned)
    forces = local - layout.drive.stiffness_n_per_m * joints[:, 7:].reshape(local.shape)
    forces[..., 0] = np.clip(forces[..., 0], 0.0, layout.drive.max_normal_force_n)
    return forces


def squeezed(
    bench: Bench, setup: Setup, forces: Array, friction: float,
    settling_friction: float | None = None,
) -> Rig:  # fmt: skip
    """Close the fingers of a bench on the unloaded object.

    Args:
        bench: With a scene whose fingers are driven by servos.
        setup: How trials are simulated.
        forces: Planned forces, (k, 3) [N].
        friction: At which the object is to be held.
        settling_friction: While closing; a multiple of `friction` if None.
    """
    high = settling_friction or setup.hold.settling_friction * friction
    (closed,) = bench.run([schedules.squeeze(forces, high, bench.clock, setup.hold)])
    return Rig(bench, setup, friction, Load(np.zeros(6), forces), closed)
