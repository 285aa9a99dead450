"""Simulates the scenes of closure tests under schedules, on MuJoCo's own threads.

The text of a scene is always what is compiled, so that the text is the whole experiment. All trials
of a scene run together; each is bit for bit what a plain loop over `mj_step` gives, whatever the
number of threads.

Every trial is a schedule: the forces planned for the fingers, the external wrench and the friction
in each sample. Loads change smoothly, because long objects spring loose under a sudden start.

Wrench hold. The fingers squeeze with planned forces while friction is raised, so that the
transients of loading cannot slip a contact that would hold at rest. Then the wrench and the forces
planned for it are applied together, the object settles, friction is lowered to the value under
test, and the object must stay where it is.

Largest wrench. The object is either held at several shares of the predicted limit (bisection), or
loaded in one slow rise through it (ramp). It lets go where it has moved by a threshold. The mass
must first be accelerated, so a ramp finds the limit late, never early.

Critical friction. Fingers squeeze the unloaded object with the forces that balance at the predicted
critical friction, friction is lowered to a trial value, and the object must stay; the trial value
is bisected.
"""

# pyright: basic, reportAttributeAccessIssue=false
# MuJoCo ships no types for its core; plain arrays and numbers leave this module.

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array, Indices, cross, to_digits
from grasp_core.errors import InputError
from scenes.mujoco.closure_scene import Scene
from scenes.mujoco.silent_mujoco import batch, mujoco, unlogged
from sim_validate.settings import FrictionProtocol, HoldProtocol, LimitProtocol

STATE = ("time", "qpos", "qvel", "ctrl", "xfrc_applied")
"""Parts of a state, which lie in the order of their bits."""
CLOCK = 0
"""Place of the time in a state."""


def compiled(xml: str) -> mujoco.MjModel:
    """Compile the text of a scene."""
    try:
        with unlogged():
            return mujoco.MjModel.from_xml_string(xml)
    except ValueError as error:
        raise InputError(f"MuJoCo cannot compile the scene: {error}") from error


def state_parts(model: mujoco.MjModel) -> dict[str, slice]:
    """Find where the parts of a state lie that a trial sets or reads, by their names in MuJoCo.

    A batch finds them too, but needs a whole `MjData` for it, which takes longer than most trials.
    """
    found, every = {}, int(mujoco.mjtState.mjSTATE_INTEGRATION)
    for name in STATE:
        bit = int(getattr(mujoco.mjtState, f"mjSTATE_{name.upper()}"))
        end = mujoco.mj_stateSize(model, (2 * bit - 1) & every)
        found[name] = slice(end - mujoco.mj_stateSize(model, bit), end)
    return found


def step(
    trials: batch.Batch, errors: dict[int, str], steps: int, going: Indices | None = None
) -> None:
    """Step trials (all, or those given by index), except those that an error ended."""
    running = going
    if errors:
        running = np.setdiff1d(np.arange(trials.nsim) if going is None else going, list(errors))
    try:
        trials.step(running, nstep=steps)
    except batch.SimulationError as failure:
        errors.update({int(trial): trials.error(int(trial)) for trial in failure.ids})


def touched(
    model: mujoco.MjModel, data: mujoco.MjData, tips: Sequence[int], *, one: bool = True
) -> tuple[Array, Array]:
    """Find where each fingertip is deepest in what it touches in a state of a scene.

    Gives normals out of the fingertips, (k, 3), world axes, and depths, (k,) [m]; NaN for a
    fingertip that touches nothing, or has several contacts where only one is right.
    """
    with unlogged():
        mujoco.mj_forward(model, data)
    normals, depths = np.full((len(tips), 3), np.nan), np.full(len(tips), np.nan)
    for finger, tip in enumerate(tips):
        own = [contact for contact in data.contact if tip in contact.geom]
        if own and not (one and len(own) > 1):
            contact = min(own, key=lambda each: each.dist)
            normals[finger] = contact.frame[:3] * (1.0 if contact.geom[0] == tip else -1.0)
            depths[finger] = -contact.dist
    return normals, depths


Mask: TypeAlias = NDArray[np.bool_]
FEWEST = 2
"""Fewest trials that room is made for: one to close the fingers, and most controls have two."""
CHUNK = 5
"""Simulation steps per sample; loads change, and motion is recorded, once per sample."""
CLOCK_SLACK_S = 1e-9
"""Largest clock error that counts as rounding [s]: simulated time is a sum of equal steps, and a
reset would change it by milliseconds."""


@dataclass(frozen=True, slots=True)
class Health:
    """Whether the simulator did what it was told in a trial."""

    finite: bool = True
    warnings: int = 0
    clock_error_s: float = 0.0
    """Simulated time minus the time stepped [s]; it is not zero after a silent reset."""
    error: str = ""
    """The simulator's own message if it gave up."""
    timed_out: bool = False

    @property
    def fault(self) -> str:
        """Why the trial proves nothing about the object, such as divergence; else empty."""
        if self.error:
            return self.error
        if self.timed_out:
            return "stopped before its end"
        if not self.finite:
            return "a number of the state is not finite"
        if self.warnings:
            return f"the simulator raised {self.warnings} warnings"
        if abs(self.clock_error_s) > CLOCK_SLACK_S:
            return f"the simulator's clock is off by {self.clock_error_s:.3g} s: it was reset"
        return ""

    def after(self, earlier: "Health") -> "Health":
        """Add the faults of an earlier trial whose end state this one started from."""
        return Health(
            finite=earlier.finite and self.finite,
            warnings=earlier.warnings + self.warnings,
            clock_error_s=earlier.clock_error_s + self.clock_error_s,
            error=earlier.error or self.error,
            timed_out=earlier.timed_out or self.timed_out,
        )


Following: TypeAlias = Callable[[Indices, Indices], Indices]
"""Function that is told which trials are at which samples, and gives the sample after it for each;
one beyond its last sample ends a trial."""


@dataclass(frozen=True, slots=True, eq=False)
class Stepped:
    """What was read of m trials, and how the simulator did in each."""

    series: tuple[Array, ...]
    """Each view that was to be kept, after each sample, (m, n, ...); zero after a trial's end."""
    counts: Indices
    """Numbers of samples that were simulated, (m,)."""
    health: tuple[Health, ...]


def stepped(
    model: mujoco.MjModel, trials: batch.Batch, steps: int, told: Sequence[tuple[Array, Array]],
    kept: Sequence[Array], lengths: Sequence[int], following: Following | None = None,
    deadline: float = math.inf,
) -> Stepped:  # fmt: skip
    """Step m trials through their samples, of so many steps each.

    Before a sample each view of the simulator in `told` gets its values, (m, n, ...); after it the
    views to be kept are read.
    """
    count, every = len(lengths), np.array(lengths)
    clock = trials.state[:count, CLOCK]
    begun = clock.copy()
    series = [np.zeros((count, every.max(), *view.shape[1:])) for view in kept]
    samples, counts = np.zeros(count, dtype=np.intp), np.zeros(count, dtype=np.intp)
    going, errors = np.arange(count), dict[int, str]()
    with unlogged():
        while going.size and time.monotonic() <= deadline:
            now = samples[going]
            rows, at, to = going, now, counts[going]
            if going.size == count and (now == now[0]).all():  # slices are quicker than indices
                rows, at, to = slice(count), now[0], to[0]
            for view, values in told:
                view[rows] = values[rows, at]
            step(trials, errors, steps, going)
            for found, view in zip(series, kept, strict=True):
                found[rows, to] = view[rows]
            counts[going] += 1
            samples[going] = then = now + 1 if following is None else following(going, now)
            left = then < every[going]
            going = going if left.all() else going[left]
    late = np.isin(np.arange(count), going)
    off = clock - (begun + steps * counts * float(model.opt.timestep))
    warned = trials.warning[:count, :, 1].sum(axis=1)
    health = tuple(
        Health(
            all(np.isfinite(each[trial]).all() for each in (trials.state, series[0])),
            int(warned[trial]), float(off[trial]), errors.get(trial, ""), bool(late[trial]),
        )
        for trial in range(count)
    )  # fmt: skip
    return Stepped(tuple(series), counts, health)


def samples(duration_s: float, sample_s: float) -> int:
    """Return the whole number of samples nearest to a duration, at least one."""
    return max(1, round(duration_s / sample_s))


def smooth(count: int) -> Array:
    """Return numbers that rise from zero to one with no slope at either end, (count,)."""
    time = np.arange(1, count + 1) / count
    return time**2 * (3.0 - 2.0 * time)


@dataclass(frozen=True, slots=True, eq=False)
class Load:
    """An external wrench with the contact forces planned to balance it."""

    wrench: Array
    """External wrench, (6,) [N, N m], torque about the centre of mass, world axes."""
    forces: Array
    """Contact forces on the object, (k, 3) [N], world axes."""


@dataclass(frozen=True, slots=True, eq=False)
class Schedule:
    """Wrench (n, 6), finger forces (n, k, 3) and friction in each of the n samples of a trial."""

    wrenches: Array
    forces: Array
    friction: Array
    watched: int
    """Index of the first sample from which the object must stay where it is."""
    resting: int
    """Index of the first sample from which load and finger forces no longer change."""

    @staticmethod
    def squeeze(
        forces: Array, friction: float, sample_s: float, protocol: HoldProtocol
    ) -> "Schedule":
        """Schedule the fingers to close on the unloaded object."""
        shares, still = smooth(samples(protocol.squeeze_s, sample_s)), np.zeros(6)
        count, opened = len(shares), Load(still, np.zeros_like(forces))
        return _between(opened, Load(still, forces), shares, (friction, friction), count, count)

    @staticmethod
    def hold(
        idle: Load, load: Load, frictions: tuple[float, float], sample_s: float,
        protocol: HoldProtocol,
    ) -> "Schedule":  # fmt: skip
        """Schedule a hold: load the squeezed object at high friction, settle, lower it, watch."""
        rise, rest = samples(protocol.load_s, sample_s), samples(protocol.settle_s, sample_s)
        shares = np.concatenate([smooth(rise), np.ones(rest + samples(protocol.hold_s, sample_s))])
        return _between(idle, load, shares, frictions, rise + rest, rise)

    @staticmethod
    def ramp(
        idle: Load, limit: Load, shares: tuple[float, float], friction: float, sample_s: float,
        protocols: tuple[HoldProtocol, LimitProtocol],
    ) -> tuple["Schedule", Array]:  # fmt: skip
        """Schedule a load that rises slowly through the largest one that is resisted.

        The load rises to the first share of the limit as in `hold`, then slowly to the second. The
        forces balance the load all the way, whether the fingers can apply them or not.

        Gives the schedule, and the share of the limit that is applied in each watched sample.
        """
        holding, limiting = protocols
        rise, rest = samples(holding.load_s, sample_s), samples(holding.settle_s, sample_s)
        lower, upper = shares
        count = samples(limiting.ramp_s, sample_s)
        climb = lower + (upper - lower) * np.arange(1, count + 1) / count
        applied = np.concatenate([lower * smooth(rise), np.full(rest, lower), climb])
        high = holding.settling_friction * friction
        return _between(idle, limit, applied, (high, friction), rise + rest, len(applied)), climb

    @staticmethod
    def release(
        still: Load, frictions: tuple[float, float], sample_s: float, protocol: FrictionProtocol, *,
        settled: bool = False,
    ) -> "Schedule":  # fmt: skip
        """Schedule a release: lower the friction of a squeezed object without load, and watch."""
        rest = 0 if settled else samples(protocol.settle_s, sample_s)
        shares = np.ones(rest + samples(protocol.hold_s, sample_s))
        return _between(still, still, shares, frictions, rest, 0)

    @staticmethod
    def settle(
        still: Load, friction: float, sample_s: float, protocol: FrictionProtocol
    ) -> "Schedule":
        """Schedule what comes before a release: a squeezed object without load settles."""
        count = samples(protocol.settle_s, sample_s)
        return _between(still, still, np.ones(count), (friction, friction), count, 0)


def _between(
    start: Load, end: Load, shares: Array, frictions: tuple[float, float], watched: int,
    resting: int,
) -> Schedule:  # fmt: skip
    friction = np.full(len(shares), frictions[0])
    friction[watched:] = frictions[1]
    wrenches = start.wrench + shares[:, None] * (end.wrench - start.wrench)
    forces = start.forces + shares[:, None, None] * (end.forces - start.forces)
    return Schedule(wrenches, forces, friction, watched, resting)


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """Where object and fingertips were in each of the n samples of a trial, in the world frame."""

    times_s: Array
    joints: Array
    """Joint positions, (n, 7 + 3k), or (n, 7) for rigid fingertips [m]: position (3) and quaternion
    (4) of the object's frame, then the slides (3) of each fingertip along its contact's axes."""
    state: Array
    """Complete state of the simulator at the end, from which a further trial can start."""
    health: Health
    skipped: int = 0
    """How many samples of its schedule were left out before friction was lowered, because the
    object had settled."""

    def after(self, earlier: "Motion") -> "Motion":
        """Add the faults of the earlier motion whose end state this motion started from."""
        return replace(self, health=self.health.after(earlier.health))


class Ends(Protocol):
    """What tells which trials may end before their schedules do: `EarlyEnds`."""

    earliest: int
    """The first sample after which it wants to look."""

    def look(
        self, places: Indices, samples: Indices, joints: Array, speeds: Array
    ) -> tuple[Mask, Mask]:
        """Tell which trials need not settle any longer, and which are answered, (n,) each."""
        ...


class Bench:
    """A compiled scene on which many trials run at once."""

    def __init__(self, scene: Scene, *, threads: int = 1, timeout_s: float = math.inf) -> None:
        self.scene, self.threads = scene, threads
        self.deadline = time.monotonic() + timeout_s
        self.model = compiled(scene.xml)
        self.sample_s = CHUNK * float(self.model.opt.timestep)
        self.body = self.model.body("object").id
        self.parts = state_parts(self.model)
        touching = np.flatnonzero(self.model.geom_contype | self.model.geom_conaffinity)
        # what lies between the first and the last may get their friction, too: it touches nothing
        self.touching = slice(touching[0], touching[-1] + 1)
        self.batch: batch.Batch | None = None

    def first_normals(self) -> Array:
        """Return the normals of the fingertips' deepest contacts before anything moves, (k, 3)."""
        count = range(len(self.scene.layout.contacts))
        tips = [self.model.geom(f"finger{finger}").id for finger in count]
        return touched(self.model, mujoco.MjData(self.model), tips, one=False)[0]

    def _trials(self, count: int) -> batch.Batch:
        """Return at least `count` trials at rest at their contacts; they are made only once."""
        if self.batch is None or self.batch.nsim < count:
            self.batch = batch.Batch(self.model, max(count, FEWEST), self.threads)
        self.batch.reset(np.arange(count), stage=mujoco.mjtStage.mjSTAGE_NONE.value)
        return self.batch

    def run(
        self, schedules: Sequence[Schedule], start: Array | None = None, ends: Ends | None = None
    ) -> tuple[Motion, ...]:
        """Simulate trials of equal length, all from the same state."""
        count, trials = len(schedules), self._trials(len(schedules))
        if start is not None:
            trials.state[:count] = start
        applied, servos, joints, speeds = (
            trials.state[:, self.parts[name]] for name in ("xfrc_applied", "ctrl", "qpos", "qvel")
        )
        applied = applied.reshape(len(applied), -1, 6)[:, self.body]
        friction = trials.expand("geom_friction")[:, self.touching, 0]
        wrenches, controls, frictions = self._applied(schedules)
        length = frictions.shape[1]
        watched = np.array([schedule.watched for schedule in schedules])
        skipped = np.zeros(count, dtype=np.intp)

        def following(going: Indices, samples: Indices) -> Indices:
            after = samples + 1
            if ends is not None and samples.min() >= ends.earliest:
                settled, answered = ends.look(going, samples, joints[going], speeds[going])
                skipped[going[settled]] += (watched[going] - after)[settled]
                after = np.where(settled, watched[going], after)
                after[answered] = length
            return after

        told = [(applied, wrenches), (servos, controls), (friction, frictions[..., None])]
        done = stepped(
            self.model, trials, CHUNK, told, [joints], [length] * count, following, self.deadline
        )
        times = self.model.opt.timestep * (CHUNK * np.arange(1, length + 1))
        return tuple(
            Motion(
                times[:samples], done.series[0][trial, :samples], trials.state[trial].copy(),
                done.health[trial], int(skipped[trial]),
            )
            for trial, samples in enumerate(done.counts.tolist())
        )  # fmt: skip

    def _applied(self, schedules: Sequence[Schedule]) -> tuple[Array, Array, Array]:
        """Return what is applied in each of n samples of m trials, as the simulator takes it.

        Gives external wrenches, (m, n, 6), commands of the servos, (m, n, q), frictions, (m, n).
        """
        layout = self.scene.layout
        wrenches = np.array([schedule.wrenches for schedule in schedules])
        wrenches[..., 3:] -= cross(layout.center, wrenches[..., :3])
        # rounded like the scene's numbers (see `closure_scene.arrange`)
        for trial in range(len(schedules)):
            for part in (wrenches[trial, :, :3], wrenches[trial, :, 3:]):
                part[...] = to_digits(part)
        controls = np.array([layout.commands(schedule.forces) for schedule in schedules])
        frictions = np.array([to_digits(schedule.friction) for schedule in schedules])
        return wrenches, controls, frictions


def first_touch(scene: Scene) -> tuple[Array, Array]:
    """Find what each fingertip touches before anything moves, as `touched` gives it."""
    model = compiled(scene.xml)
    tips = [model.geom(f"finger{finger}").id for finger in range(len(scene.layout.contacts))]
    return touched(model, mujoco.MjData(model), tips)
