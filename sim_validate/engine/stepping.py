"""Steps trials of a scene in MuJoCo, on its own threads: the loop that all simulations run in.

The text of a scene is always what is compiled, so that the text is the whole experiment. All trials
of a scene run together; each is bit for bit what a plain loop over `mj_step` gives, whatever the
number of threads. A trial is what the scene is told in each sample: the wrench on the object, the
servos' commands and, where a trial has them, forces on the palm, frictions, and the pose of a body
that moves as told.
"""

# pyright: basic, reportAttributeAccessIssue=false
# MuJoCo ships no types for its core; plain arrays and numbers leave this module.

import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Generic, TypeAlias, TypeVar

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.errors import InputError
from grasp_core.time_spent import TIME_SPENT
from scenes.mujoco.mjcf_text import SceneText
from scenes.mujoco.version_gaps import WRONG_FACTOR
from scenes.silent_mujoco import batch, mujoco, unlogged

STATE = (
    "time", "qpos", "qvel", "ctrl", "qfrc_applied", "xfrc_applied", "mocap_pos", "mocap_quat",
)  # fmt: skip
"""Parts of a state, which lie in the order of their bits."""


def _bits(name: str) -> int:
    """Return the bits of a part of a state, or of all of it."""
    named = "INTEGRATION" if name == "state" else name.upper()
    return int(getattr(mujoco.mjtState, f"mjSTATE_{named}"))


WHOLE_STATE = _bits("state")
TOLD_BITS = sum(map(_bits, (*STATE[STATE.index("ctrl") :], "eq_active")))
"""Bits of the parts of a state from the servos' commands to the pose of what moves as told."""
LONGEST_BLOCK = 64
"""Largest number of samples that are simulated in one call, so that memory stays small."""
CLOCK = 0
OBJECT_END, PALM_END = 6, 12
"""Joint velocities up to the end of the object's, and up to the end of the palm's."""
FEWEST_SIMULATIONS = 2
"""Fewest trials that room is made for: one to close the fingers, and most controls have two."""
CLOSURE_STEPS = 5
BAD_STATE = [
    getattr(mujoco.mjtWarning, f"mjWARN_BADQ{part}").value for part in ("POS", "VEL", "ACC")
]
"""Warnings of numbers that are not finite, or so large that they soon will not be."""
CLOCK_SLACK_S = 1e-9
"""Largest clock error that counts as rounding [s]: simulated time is a sum of equal steps, and a
reset would change it by milliseconds."""


@TIME_SPENT.on("scenes")
def compiled(xml: str) -> mujoco.MjModel:
    """Compile the text of a scene."""
    try:
        with unlogged():
            model = mujoco.MjModel.from_xml_string(xml)
    except ValueError as error:
        raise InputError(f"MuJoCo cannot compile the scene: {error}") from error
    newton = model.opt.solver == mujoco.mjtSolver.mjSOL_NEWTON
    # the Jacobian `auto` is sparse in large models
    if newton and mujoco.mj_isSparse(model) and mujoco.mj_versionString() == WRONG_FACTOR:
        raise InputError(
            "physics.jacobian must be dense with the solver Newton, got a sparse Jacobian of "
            f"{model.nv} degrees of freedom, with which MuJoCo {WRONG_FACTOR} gives wrong "
            "accelerations; set jacobian to dense, or solver to CG or PGS, or install MuJoCo 4.0.1 "
            "or later"
        )
    return model


def state_parts(model: mujoco.MjModel) -> dict[str, slice]:
    """Find where the parts of a state lie that a trial sets or reads, by their names in MuJoCo.

    A batch finds them too, but needs a whole `MjData` for it, which takes longer than most trials.
    """
    found, every = {}, WHOLE_STATE
    for name in STATE:
        bit = _bits(name)
        end = mujoco.mj_stateSize(model, (2 * bit - 1) & every)
        found[name] = slice(end - mujoco.mj_stateSize(model, bit), end)
    return found


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


@dataclass(frozen=True, slots=True, eq=False)
class Told:
    """What a scene is told in each of the n samples of a trial; what is None stays as it is."""

    wrenches: Array
    """Force and torque on the object about its middle, world axes, (n, 6) [N, N m]."""
    commands: Array
    """Commands of the servos, (n, u)."""
    palm: Array | None = None
    """Forces on the palm's slides and hinges, (n, 6) [N, N m]."""
    friction: Array | None = None
    """Frictions of the shapes that rub (see `Bench`), (n, shapes), or (n, 1) for all of them."""
    mocap: Array | None = None
    """Pose of the body that moves as told, position and quaternion, (n, 7)."""
    joints: Array | None = None
    """Positions of all joints at the start, (q,)."""
    velocity: Array | None = None
    """What is added to the velocities of object and palm at the start, (3,) [m/s]."""


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """What was read after each of the n samples of a trial, in the world frame."""

    times_s: Array
    joints: Array
    """Joint positions, (n, q) [m]: position (3) and quaternion (4) of the object's frame, then
    those of what holds it: the slides (3) of each fingertip along its contact's axes."""
    state: Array
    """Complete state of the simulator at the end, from which a further trial can start."""
    health: Health
    skipped: int = 0
    """How many samples were left out, because the object had settled."""
    kept: tuple[Array, ...] = ()
    """What else its bench keeps, (n, ...) each."""

    def after(self, earlier: "Motion") -> "Motion":
        """Add the faults of the earlier motion whose end state this motion started from."""
        return replace(self, health=self.health.after(earlier.health))


@dataclass(frozen=True, slots=True, eq=False)
class Inputs:
    """What the simulator is told in each of n samples of trials."""

    told: Array
    """All inputs in a state, from the servos' commands on, (trials, n, inputs)."""
    first: int
    """Where inputs begin in a state."""
    used: tuple[slice, ...]
    """Parts of a state that are told."""
    friction: tuple[Array, Array] | None
    """The simulator's frictions, (simulations, shapes), and the values told, (trials, n,
    shapes)."""

    def views(self, states: Array) -> list[tuple[Array, Array]]:
        """Return the views of the simulator's states and frictions that are told, and what."""
        told = [
            (states[:, part], self.told[:, :, part.start - self.first : part.stop - self.first])
            for part in self.used
        ]
        return told if self.friction is None else [*told, self.friction]

    def blocks(self, unseen: int) -> Iterator[tuple[int, int]]:
        """Yield first samples, and ends, of blocks of the first samples of like friction."""
        end = max(0, min(unseen, self.told.shape[1]))
        cuts = {*range(0, end, LONGEST_BLOCK), end}
        if self.friction is not None:
            changes = np.diff(self.friction[1][:, :end], axis=1).any(axis=(0, 2))
            cuts |= set((1 + np.flatnonzero(changes)).tolist())
        return pairwise(sorted(cuts))


Following: TypeAlias = Callable[[Indices, Indices, Array, Array], Indices]
"""Function that is told which trials are at which samples, with positions and speeds of the joints
of all trials, and gives the sample after it for each; one beyond its last sample ends a trial."""


AnyScene = TypeVar("AnyScene", bound=SceneText)


class Bench(Generic[AnyScene]):
    """A compiled scene on which many trials run at once.

    What changes is told, and what moves is read, once per sample of `chunk` steps. Beside the
    positions of the joints, what is named in `kept` is read.
    """

    def __init__(
        self, scene: AnyScene, *, threads: int = 1, timeout_s: float = math.inf,
        chunk: int = CLOSURE_STEPS, step_s: float | None = None, kept: Sequence[str] = (),
    ) -> None:  # fmt: skip
        self.scene, self.threads, self.chunk, self.kept = scene, threads, chunk, kept
        self.deadline = time.monotonic() + timeout_s
        self.model = compiled(scene.xml)
        self.step_s = float(self.model.opt.timestep) if step_s is None else step_s
        self.model.opt.timestep = self.step_s
        self.sample_s = chunk * self.step_s
        self.body = self.model.body("object").id
        self.home: Array = self.model.qpos0
        self.moves_as_told: bool = self.model.nmocap > 0
        self.roughness: Array = self.model.geom_friction[:, 0]
        self.parts = state_parts(self.model)
        touching = np.flatnonzero(self.model.geom_contype | self.model.geom_conaffinity)
        # what lies between the first and the last may get their friction, too: it touches nothing
        self.rubbing = slice(touching[0], touching[-1] + 1)
        self.batch: batch.Batch | None = None
        self.frictions: Array | None = None
        """Frictions of all shapes in each simulation, (trials, shapes, 3), once some are told."""

    def simulated(
        self, trials: Sequence[Told], start: Array | None = None,
        following: Following | None = None, unseen: int = 0,
    ) -> tuple[Motion, ...]:  # fmt: skip
        """Simulate trials, all from the same state, (size,), or from one each, (trials, size).

        Before the sample `unseen` there is nothing that `following` must be told.
        """
        sims, lengths = self._begun(trials, start), [len(each.wrenches) for each in trials]
        count, most = len(trials), max(lengths)
        inputs, begun = self._inputs(sims, trials, most), sims.state[:count, CLOCK].copy()
        views = {name: self._field(sims, name) for name in ("qpos", *self.kept)}
        read = {name: np.zeros((count, most, *view.shape[1:])) for name, view in views.items()}
        told, seen = inputs.views(sims.state), [(views[name], read[name]) for name in views]
        unseen = min(lengths) if following is None else unseen
        with TIME_SPENT.on("stepping"):
            ahead = self._rolled(sims, inputs, read, unseen)
            ends = self._stepped(sims, told, seen, lengths, following, ahead)
        counts, stepped, skipped, errors, late = ends
        off = sims.state[:count, CLOCK] - (begun + self.chunk * stepped * self.step_s)
        times = np.arange(1.0, most + 1.0) * self.chunk * self.step_s
        motions = list[Motion]()
        for trial, own in enumerate(counts.tolist()):
            joints, *kept = (series[trial, :own] for series in read.values())
            state = sims.state[trial].copy()
            health = Health(
                bool(np.isfinite(state).all() and np.isfinite(joints).all()),
                int(sims.warning[trial, :, 1].sum()), float(off[trial]), errors.get(trial, ""),
                trial in late,
            )  # fmt: skip
            motions.append(
                Motion(times[:own], joints, state, health, int(skipped[trial]), tuple(kept))
            )
        return tuple(motions)

    def _rolled(
        self, sims: batch.Batch, inputs: "Inputs", read: Mapping[str, Array], unseen: int
    ) -> int:
        """Simulate samples in which nothing is looked at, many in one call; return their number.

        It ends early before trouble, such as a warning, which is to be seen sample by sample.
        """
        count, every, end = len(inputs.told), np.arange(len(inputs.told)), 0
        for first, end in inputs.blocks(unseen):
            if time.monotonic() > self.deadline:
                return first
            before = sims.state[:count].copy()
            if inputs.friction is not None:
                view, values = inputs.friction
                view[:count] = values[:, first]
            told = np.repeat(inputs.told[:, first:end], self.chunk, axis=1)
            record = {_bits(name) if name in {"state", *STATE} else name: name for name in read}
            try:
                with unlogged():
                    found = sims.rollout(told.shape[1], told, TOLD_BITS, tuple(record), every)
            except batch.SimulationError:
                found = None
            if found is None or sims.warning[:count, :, 1].any():
                sims.reset(every, stage=mujoco.mjtStage.mjSTAGE_NONE.value)
                sims.state[:count] = before
                return first
            for own, name in record.items():
                read[name][:, first:end] = found[own][:, self.chunk - 1 :: self.chunk]
        return end

    def _stepped(
        self, sims: batch.Batch, told: Sequence[tuple[Array, Array]],
        read: Sequence[tuple[Array, Array]], lengths: Sequence[int], following: Following | None,
        ahead: int,
    ) -> tuple[Indices, Indices, Indices, dict[int, str], Indices]:  # fmt: skip
        """Step trials through their samples, after those that were simulated `ahead`.

        Before a sample each view of the simulator gets the values that are told, after it each view
        that is read is copied. A trial that has diverged stays as it is: to step numbers that are
        not finite takes a hundred times as long. Gives the numbers of samples that were read,
        simulated and left out, errors, and the trials that were stopped before their ends.
        """
        every, count = np.array(lengths), len(lengths)
        joints, speeds = self._field(sims, "qpos"), self._field(sims, "qvel")
        samples, counts, stepped = np.full((3, count), ahead, dtype=np.intp)
        skipped, errors = np.zeros(count, dtype=np.intp), dict[int, str]()
        diverged, going = np.zeros(count, dtype=bool), np.flatnonzero(samples < every)
        with unlogged():
            while going.size and time.monotonic() <= self.deadline:
                now = samples[going]
                rows, at, to = going, now, counts[going]
                if going.size == count and (now == now[0]).all():  # slices are quicker than indices
                    rows, at, to = slice(count), now[0], to[0]
                for view, values in told:
                    view[rows] = values[rows, at]
                running = going[~diverged[going]] if diverged.any() else going
                stepped[running] += 1
                try:
                    sims.step(running, nstep=self.chunk)
                except batch.SimulationError as failure:
                    errors.update({int(trial): sims.error(int(trial)) for trial in failure.ids})
                    diverged[failure.ids] = True
                diverged |= sims.warning[:count, BAD_STATE, 1].any(axis=1)
                for view, found in read:
                    found[rows, to] = view[rows]
                counts[going] += 1
                samples[going] = then = now + 1
                if following is not None:
                    samples[going] = then = following(going, now, joints, speeds)
                left = then < every[going]
                if (then > now + 1).any():
                    skipped[going] += left * (then - now - 1)
                going = going if left.all() else going[left]
        return counts, stepped, skipped, errors, going

    def shapes(self, names: Sequence[str]) -> list[int]:
        """Return the places of shapes that have names."""
        return [self.model.geom(name).id for name in names]

    def touched(
        self, tips: Sequence[str], joints: Array | None = None, *, one: bool = True
    ) -> tuple[Array, Array]:
        """Find where each fingertip is deepest in what it touches before anything moves.

        Takes where the joints are; None for their home. Gives normals out of the fingertips,
        (k, 3), world axes, and depths, (k,) [m]; NaN for a fingertip that touches nothing, or has
        several contacts where only one is right.
        """
        data = mujoco.MjData(self.model)
        if joints is not None:
            data.qpos[:] = joints
        with unlogged():
            mujoco.mj_forward(self.model, data)
        normals, depths = np.full((len(tips), 3), np.nan), np.full(len(tips), np.nan)
        met, heights = data.contact.geom, data.contact.dist
        outward = data.contact.frame.reshape(-1, 9)[:, :3]
        for finger, tip in enumerate(self.shapes(tips)):
            own = np.flatnonzero((met == tip).any(axis=1))
            if own.size and not (one and own.size > 1):
                deepest = own[np.argmin(heights[own])]
                normals[finger] = outward[deepest] * (1.0 if met[deepest, 0] == tip else -1.0)
                depths[finger] = -heights[deepest]
        return normals, depths

    def touching(self, states: Sequence[Array]) -> list[set[str]]:
        """Return the names of the bodies that touch the object in states."""
        data, found = mujoco.MjData(self.model), list[set[str]]()
        for state in states:
            mujoco.mj_setState(self.model, data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
            mujoco.mj_forward(self.model, data)
            bodies = self.model.geom_bodyid[data.contact.geom]
            met = bodies[(bodies == self.body).any(axis=1)].ravel().tolist()
            found.append({self.model.body(place).name for place in set(met) - {self.body}})
        return found

    def _begun(self, trials: Sequence[Told], start: Array | None) -> batch.Batch:
        """Return the simulations of trials at their starts; they are made only once."""
        count = len(trials)
        if self.batch is None or self.batch.nsim < count:
            self.batch = batch.Batch(self.model, max(count, FEWEST_SIMULATIONS), self.threads)
            self.frictions = None
        self.batch.reset(np.arange(count), stage=mujoco.mjtStage.mjSTAGE_NONE.value)
        if self.frictions is not None:
            self.frictions[:] = self.model.geom_friction
        if start is not None:
            self.batch.state[:count] = start
        joints, speeds = self._field(self.batch, "qpos"), self._field(self.batch, "qvel")
        for trial, each in enumerate(trials):
            if each.joints is not None:
                joints[trial] = each.joints
            if each.velocity is not None:
                speeds[trial, :3] += each.velocity
                speeds[trial, OBJECT_END : OBJECT_END + 3] += each.velocity
        return self.batch

    def _field(self, sims: batch.Batch, name: str) -> Array:
        """Return a part of all states, or another field, which changes with the simulations."""
        if name == "state":
            return sims.state
        return sims.state[:, self.parts[name]] if name in self.parts else sims.bind(name)

    def _inputs(self, sims: batch.Batch, trials: Sequence[Told], most: int) -> "Inputs":
        """Lay out what the simulator is told in each sample.

        A trial that is told nothing where others are keeps what is there.
        """
        wrench = self.parts["xfrc_applied"].start + 6 * self.body
        palm = self.parts["qfrc_applied"].start
        columns = {
            "wrenches": slice(wrench, wrench + 6),
            "commands": self.parts["ctrl"],
            "palm": slice(palm + OBJECT_END, palm + PALM_END),
            "mocap": slice(self.parts["mocap_pos"].start, self.parts["mocap_quat"].stop),
        }
        given = slice(self.parts["ctrl"].start, self.parts["mocap_quat"].stop)
        told = np.repeat(sims.state[: len(trials), None, given], most, axis=1)
        used = list[slice]()
        for name, where in columns.items():
            rows = [getattr(each, name) for each in trials]
            for own, row in zip(told, rows, strict=True):
                if row is not None:
                    own[: len(row), where.start - given.start : where.stop - given.start] = row
            if any(row is not None for row in rows):
                used.append(where)
        frictions = [each.friction for each in trials]
        if all(each is None for each in frictions):
            return Inputs(told, given.start, tuple(used), None)
        self.frictions = sims.expand("geom_friction")
        view = self.frictions[:, self.rubbing, 0]
        rubs = np.repeat(view[: len(trials), None], most, axis=1)
        for own, row in zip(rubs, frictions, strict=True):
            if row is not None:
                own[: len(row)] = row
        return Inputs(told, given.start, tuple(used), (view, rubs))
