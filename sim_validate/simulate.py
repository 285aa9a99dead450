"""Scene and loads -> trace of motion; the only loop that steps MuJoCo.

The scene's text is compiled, never a model built otherwise, so that the text is the whole
experiment. Displacements are measured on the object's pose, not on contact counts.
"""

# pyright: basic, reportAttributeAccessIssue=false
# MuJoCo ships no types for its core; plain arrays and numbers leave this module.

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import mujoco  # noqa: TID251 - this is the door
import numpy as np

from grasp_core.arrays import Array
from grasp_core.wrenches import normal_and_tangential
from scenes.mjcf import Scene
from sim_validate.protocol import HoldProtocol

CHUNK = 5
"""Steps between changes of load and samples of motion."""
LOST = 1.0
"""Stop when the object has moved by this many grasp sizes: it is gone."""


@dataclass(frozen=True, slots=True, eq=False)
class Load:
    """An external wrench with the contact forces planned to balance it."""

    wrench: Array
    """(6,) [N, N m], about the centre of mass, world axes."""
    forces: Array
    """(k, 3) [N], world axes."""


@dataclass(frozen=True, slots=True, eq=False)
class HoldTrace:
    """Motion of the object and fingertips from the moment friction was lowered."""

    times_s: Array
    """(n,)"""
    displacements_m: Array
    """Motion of the point between the contacts plus grasp size times rotation, (n,)."""
    rotations_rad: Array
    """(n,)"""
    slips_m: Array
    """Tangential motion of each fingertip over its face, (n, k)."""
    gaps_m: Array
    """Distance of each fingertip from its face, negative in contact, (n, k)."""
    start_m: float
    """Displacement from the planned pose at that moment."""
    finite: bool
    """Whether every number of the state stayed finite."""
    warnings: int
    """How many warnings the simulator raised."""
    clock_error_s: float
    """Simulated time minus the time stepped: not zero after a silent reset."""


class Bench:
    """A compiled scene on which wrenches are tried, one after another from the same start."""

    def __init__(self, scene: Scene, protocol: HoldProtocol) -> None:
        self.scene, self.protocol = scene, protocol
        self.layout = scene.layout
        self.model = mujoco.MjModel.from_xml_string(scene.xml)
        self.data = mujoco.MjData(self.model)
        self.fingers = len(self.layout.contacts)
        self.body = self.model.body("object").id
        tips = [f"{kind}{i}" for kind in ("pad", "finger") for i in range(self.fingers)]
        self.touching = [self.model.geom(name).id for name in tips]
        self.tip_bodies = [self.model.body(f"finger{i}").id for i in range(self.fingers)]
        self.start = np.empty(0)
        self.idle = np.zeros((self.fingers, 3))
        self.stepped = self.squeezed = self.warned = 0

    def squeeze(self, forces: Array, friction: float) -> None:
        """Close the fingers on the unloaded object and remember the state reached.

        Args:
            forces: Planned forces, (k, 3) [N].
            friction: While closing.
        """
        mujoco.mj_resetDataKeyframe(self.model, self.data, self.model.key("grasp").id)
        self.stepped = 0
        self.idle = forces
        self._set_friction(friction)
        nothing = Load(np.zeros(6), np.zeros_like(forces))
        self._ramp(nothing, Load(np.zeros(6), forces), self.protocol.squeeze_s)
        kind = mujoco.mjtState.mjSTATE_INTEGRATION
        self.start = np.empty(mujoco.mj_stateSize(self.model, kind))
        mujoco.mj_getState(self.model, self.data, self.start, kind)
        self.squeezed = self.stepped

    def hold(self, load: Load, settling_friction: float, friction: float) -> HoldTrace:
        """Apply a load to the squeezed object, lower the friction and watch."""
        mujoco.mj_setState(
            self.model, self.data, self.start, mujoco.mjtState.mjSTATE_INTEGRATION
        )  # fmt: skip
        self.stepped = self.squeezed
        self.warned = self._warnings()
        self._set_friction(settling_friction)
        self._ramp(Load(np.zeros(6), self.idle), load, self.protocol.load_s)
        self._ramp(load, load, self.protocol.settle_s)
        self._set_friction(friction)
        return self._watch(self.protocol.hold_s)

    def _warnings(self) -> int:
        """Warnings so far: restoring a state does not reset their counters."""
        return int(sum(warning.number for warning in self.data.warning))

    def _set_friction(self, friction: float) -> None:
        self.model.geom_friction[self.touching, 0] = friction

    def _ramp(self, start: Load, end: Load, duration_s: float) -> None:
        """Change the load smoothly: with a sudden start long objects spring loose."""
        rounds = self._rounds(duration_s)
        for done in range(1, rounds + 1):
            time = done / rounds
            share = time**2 * (3.0 - 2.0 * time)
            self._apply(
                start.forces + share * (end.forces - start.forces),
                start.wrench + share * (end.wrench - start.wrench),
            )
            self._step()

    def _rounds(self, duration_s: float) -> int:
        return max(1, round(duration_s / (CHUNK * self.model.opt.timestep)))

    def _apply(self, forces: Array, wrench: Array) -> None:
        local = np.einsum("kij,ki->kj", self.layout.frames, forces)
        self.data.ctrl[:] = local.ravel() / self.layout.drive.stiffness_n_per_m
        torque = wrench[3:] - np.cross(self.layout.center, wrench[:3])
        self.data.xfrc_applied[self.body] = np.concatenate([wrench[:3], torque])

    def _step(self) -> None:
        with _unlogged():
            mujoco.mj_step(self.model, self.data, nstep=CHUNK)
        self.stepped += CHUNK

    def _pose(self) -> tuple[Array, Array]:
        """Where the point between the contacts is (3,), and the object's rotation (3, 3)."""
        mujoco.mj_kinematics(self.model, self.data)
        rotation = self.data.xmat[self.body].reshape(3, 3).copy()
        return self.data.xpos[self.body] + rotation @ self.layout.center, rotation

    def _tips(self, position: Array, rotation: Array) -> Array:
        """Fingertip centres in the object's frame, (k, 3)."""
        return (self.data.xpos[self.tip_bodies] - position) @ rotation + self.layout.center

    def _watch(self, duration_s: float) -> HoldTrace:
        layout, normals = self.layout, self.layout.frames[:, :, 0]
        size = layout.grasp_size_m
        position0, rotation0 = self._pose()
        tips0 = self._tips(position0, rotation0)
        begun = self.stepped
        rows: list[tuple[float, float, float, Array, Array]] = []
        for _ in range(self._rounds(duration_s)):
            self._step()
            position, rotation = self._pose()
            tips = self._tips(position, rotation)
            turn = rotation_angle(rotation @ rotation0.T)
            moved = float(np.linalg.norm(position - position0)) + size * turn
            _, slip = normal_and_tangential(tips - tips0, normals)
            height = np.einsum("ki,ki->k", layout.contacts - tips, normals)
            time = (self.stepped - begun) * self.model.opt.timestep
            rows.append((time, moved, turn, slip, height - layout.drive.radius_m))
            if not moved < LOST * size:
                break
        times, moves, turns, slips, gaps = (np.array(column) for column in zip(*rows, strict=True))
        start = float(np.linalg.norm(position0 - layout.center)) + size * rotation_angle(rotation0)
        state = np.concatenate([self.data.qpos, self.data.qvel, self.data.qacc])
        return HoldTrace(
            times_s=times,
            displacements_m=moves,
            rotations_rad=turns,
            slips_m=slips,
            gaps_m=gaps,
            start_m=start,
            finite=bool(np.isfinite(state).all() and np.isfinite(moves).all()),
            warnings=self._warnings() - self.warned,
            clock_error_s=float(self.data.time - self.stepped * self.model.opt.timestep),
        )


@contextmanager
def _unlogged() -> Iterator[None]:
    """Keep the simulator from writing warnings to a file in the working directory.

    They are counted in its data, and `HoldTrace.warnings` reports them.
    """
    before, quiet = mujoco.MjLogConfig.get(), mujoco.MjLogConfig.get()
    quiet.logto_file = quiet.logto_console = False
    mujoco.MjLogConfig.set(quiet)
    try:
        yield
    finally:
        mujoco.MjLogConfig.set(before)


def rotation_angle(rotation: Array) -> float:
    """Angle of a rotation matrix [rad], exact for small angles."""
    axis = np.array(
        [
            rotation[2, 1] - rotation[1, 2],
            rotation[0, 2] - rotation[2, 0],
            rotation[1, 0] - rotation[0, 1],
        ]
    )
    return float(np.arctan2(np.linalg.norm(axis), np.trace(rotation) - 1.0))
