"""Simulates the runs of a published test and returns what each look at the object finds."""

# pyright: basic, reportAttributeAccessIssue=false
# MuJoCo ships no types for its core; plain arrays and numbers leave this module.

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array, Indices
from scenes.tested.tested_object import TestedScene
from sim_validate.protocols.timelines import CHUNK, Timeline
from sim_validate.simulation.engine import batch, compiled, mujoco, step, unlogged

FREE = 7
"""Coordinates of the object's free joint, which come first."""


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """The object in each of the n samples of a run, and which fingers touch it at each look."""

    poses: Array
    """Position of the object's centre of mass and its orientation (w, x, y, z), (n, 7)."""
    start: Array
    """Its pose before the fingers close, (7,)."""
    touching: tuple[frozenset[int], ...]
    """For each look, the fingers that touch the object."""
    fault: str
    """What went wrong in the simulator; empty if nothing did."""


class TestBench:
    """A compiled scene on which the runs of a test are simulated together."""

    __test__ = False  # no class of tests, whatever its name begins with

    def __init__(self, scene: TestedScene, threads: int = 1) -> None:
        """Compile a scene."""
        self.scene, self.threads = scene, threads
        self.model = compiled(scene.xml)
        self.data = mujoco.MjData(self.model)
        self.body = self.model.body("object").id
        self.fingers = {
            self.model.body(name).id: finger
            for finger, names in enumerate(scene.fingers)
            for name in names
        }

    def run(self, runs: Sequence[Timeline], starts: Array, began: Array) -> tuple[Motion, ...]:
        """Simulate runs, each from the same fingers.

        Takes `starts` (n, 7); `began` (u,).
        """
        count = len(runs)
        trials = batch.Batch(self.model, max(count, 2), self.threads)
        trials.reset(np.arange(count), stage=mujoco.mjtStage.mjSTAGE_NONE.value)
        joints = trials.bind("qpos")
        joints[:count, :FREE], joints[:count, FREE:] = starts, began
        lengths = np.array([len(each.commands) for each in runs])
        poses = np.zeros((count, int(lengths.max()), FREE))
        touching: list[list[frozenset[int]]] = [[] for _ in runs]
        errors = self._stepped(trials, runs, lengths, poses, touching)
        return tuple(
            Motion(
                poses[place, :length], starts[place], tuple(touching[place]),
                _fault(trials, place, errors),
            )
            for place, length in enumerate(lengths.tolist())
        )  # fmt: skip

    def _stepped(
        self, trials: "batch.Batch", runs: Sequence[Timeline], lengths: Indices, poses: Array,
        touching: list[list[frozenset[int]]],
    ) -> dict[int, str]:  # fmt: skip
        commands, applied = trials.bind("ctrl"), trials.bind("xfrc_applied")
        told = (trials.bind("mocap_pos"), trials.bind("mocap_quat")) if self.model.nmocap else ()
        joints = trials.bind("qpos")
        looks = [{look for look, _ in each.looks} for each in runs]
        errors: dict[int, str] = {}
        with unlogged():
            for sample in range(int(lengths.max())):
                going = np.flatnonzero(lengths > sample)
                for place in going.tolist():
                    now = runs[place].commands[sample]
                    commands[place] = now[FREE:] if told else now
                    for part, values in zip(told, np.split(now[:FREE], [3]), strict=False):
                        part[place, 0] = values
                    applied[place, self.body] = runs[place].wrenches[sample]
                step(trials, errors, CHUNK, going)
                poses[going, sample] = joints[going, :FREE]
                for place in going.tolist():
                    if sample in looks[place]:
                        touching[place].append(self._touching(trials.state[place]))
        return errors

    def _touching(self, state: Array) -> frozenset[int]:
        """Find the fingers that touch the object in a state."""
        if not np.isfinite(state).all():
            return frozenset()
        signature = int(mujoco.mjtState.mjSTATE_INTEGRATION)
        mujoco.mj_setState(self.model, self.data, state, signature)
        mujoco.mj_forward(self.model, self.data)
        bodies = self.model.geom_bodyid[self.data.contact.geom]
        met = bodies[(bodies == self.body).any(axis=1)].ravel().tolist()
        return frozenset(self.fingers[body] for body in met if body in self.fingers)


def _fault(trials: "batch.Batch", place: int, errors: dict[int, str]) -> str:
    if place in errors:
        return errors[place]
    if not np.isfinite(trials.state[place]).all():
        return "a number of the simulator's state is not finite"
    warnings = int(trials.warning[place, :, 1].sum())
    return f"the simulator raised {warnings} warnings" if warnings else ""
