"""The smallest multiple of a load at which a contact of a grip begins to slip.

*The pose under a load of any size*, as long as no contact slips. The linear response of `grips`
holds for small motions. Soft fingertips let the object move by millimetres, so the load is raised
in steps and the equilibrium is found anew at each: Newton steps with the stiffness (5) of `grips`
at the pose reached. A turn by t carries tip centres along by (2) there and rolls them on their
faces. Rolling depends on the path, of which every Newton step is a part; the steps are short, and
what remains is of third order in their length.

*The first slip.* The commands of the fingers stay as they are while the load grows. Contact i slips
where its tangential force reaches the cone, |t| = mu n, which happens at n = 0 at the latest. In
the linear model the force along the contact's axes is f + s A w (see `grips`), so with its parts
(n, t) and those (a, b) of A w the first slip is at the least positive root s of

    |t + s b|^2 = mu^2 (n + s a)^2    with    n + s a >= 0.                               (1)

The finite model follows the equilibrium: at each pose (1) says how far the load can grow if the
response stays as it is; the load is raised by that, or by as much as moves the object by a small
step, and the response is taken anew. The steps to the root become Newton's, and the root is met to
`SLIP_MET`. A finger with a limit on its push is also checked against it: beyond the limit no closed
grasp is sure to resist (see `wrench_limits`), so that a first slip with limits is never above the
closure limit.

Motors may be at the limit of their torques first. With the torque tau_j = (L f + g)_j of a joint
and its change d_j = (L C w)_j per load, both in the object's axes (see `squeeze_certificate`), that
is at

    s = (c_j - sign(d_j) tau_j) / |d_j|,                                                  (2)

and beyond it the finger gives way, although no contact slips.
"""

import math
from dataclasses import dataclass
from typing import Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.allowed_values import LARGEST, SMALLEST, number, one_of
from grasp_core.arrays import Array, cross, frozen
from grasp_core.by_value import ByValue
from grasp_core.closure.contacts import cross_matrix, grasp_map
from grasp_core.declared import trusted
from grasp_core.errors import InputError, SolverError
from grasp_core.execution.grips import Grip, check_grip
from grasp_core.quality.motors import Motors, motors_for

LEFT_WRENCH = 1e-11
"""Largest wrench that is left, relative to the pushes and the load."""
MOST_NEWTON = 50
"""Newton steps for one load; four or five are usual."""
Event: TypeAlias = Literal["slip", "push limit", "torque limit", "unstable", "none"]
"""What ends the growth of a load: a contact slips, a finger reaches its limit, a joint its torque,
the equilibrium is not stable any more, or nothing up to `LARGEST_LOAD`."""
SlipModel: TypeAlias = Literal["finite", "linear"]
"""Whether the object's motion is followed, or taken to be small."""
LARGEST_LOAD = 1e6
"""Largest load that is tried, in units of the largest push at rest."""
LARGEST_STEP = 0.02
"""Largest motion of the object in one step, in arms' lengths or radians."""
SLIP_MET = 1e-9
"""How near the load of first slip is met, relative to it."""
MOST_LOAD_STEPS = 1000
SMALLEST_STEP = 1e-6
"""Part of a step at which the equilibrium ends, rather than that Newton's method fails."""
REST_SLACK = 1e-9
"""How far a squeeze may leave a cone or limit at rest, in largest pushes."""


@dataclass(frozen=True, slots=True, eq=False)
class Equilibrium:
    """A grip in equilibrium under a load."""

    start: Grip  # the grip at rest
    grip: Grip  # the grip in this pose: arms, normals and forces as they are now
    moved: Array  # displacement of the centre of mass, (3,) [m]
    rotation: Array  # orientation of the object against the one at rest, (3, 3)

    def under(self, load: Array) -> "Equilibrium":
        """Find the equilibrium under a load, starting from this one, under a load nearby."""
        held, scale = self, np.repeat([1.0, self.start.size], 3)
        unit = np.linalg.norm(self.start.squeeze, axis=1).sum()
        unit += float(np.linalg.norm(load / scale))
        for _ in range(MOST_NEWTON):
            left = grasp_map(held.grip.arms) @ held.grip.squeeze.ravel() + load
            if float(np.abs(left / scale).max()) <= LEFT_WRENCH * unit:
                return held
            held = held.stepped(held.grip.compliance @ left)
            if not np.isfinite(held.grip.arms).all():
                break
        raise SolverError("no equilibrium of the loaded grip was found")

    def stepped(self, step: Array) -> "Equilibrium":
        """Move the object by a translation and a turn, and let the tips follow."""
        shift, turn = step[:3], step[3:]
        start, grip, R = self.start, self.grip, rotation(turn)
        radii = grip.tip_radius_m[:, None]
        # a tip's centre is at r - rho n from the centre of mass, and rolls by rho (t x n) on the
        # face
        half = rotation(0.5 * turn)
        centers = (grip.arms - radii * grip.normals) @ R.T
        centers += radii * cross(turn, grip.normals @ half.T)
        normals, moved = grip.normals @ R.T, self.moved + shift
        tips = moved + centers - (start.arms - radii * start.normals)
        forces = start.squeeze - np.einsum("kij,kj->ki", start.stiffness, tips)
        turned = trusted(
            Grip, arms=centers + radii * normals, normals=normals, friction=grip.friction,
            squeeze=forces, stiffness=grip.stiffness, tip_radius_m=grip.tip_radius_m,
        )  # fmt: skip
        return Equilibrium(start, turned, moved, R @ self.rotation)


def rotation(turn: Array) -> Array:
    """Compute the rotation by a vector, (3,) [rad], as a matrix (3, 3)."""
    angle = float(np.linalg.norm(turn))
    C = cross_matrix(turn)
    # sin(a) / a and (1 - cos(a)) / a^2, the second without cancellation
    return np.eye(3) + np.sinc(angle / np.pi) * C + 0.5 * np.sinc(angle / (2 * np.pi)) ** 2 * C @ C


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class FirstSlip(ByValue):
    """Where the growth of a load ends."""

    multiple: float
    """Multiple of the load at which it ends; infinite where nothing happens."""
    event: Event
    """What happens there: `slip`, `push limit`, `torque limit`, `unstable` or `none`."""
    contact: int
    """Index of the contact where it happens; -1 for events of a joint or of the whole grip."""
    forces: Array
    """Contact forces then, on the object, world axes, (k, 3) [N]."""
    arms: Array
    """Contact points then, from the centre of mass, world axes, (k, 3) [m]; in the linear model
    those at rest."""
    normals: Array
    """Unit normals then, into the object, world axes, (k, 3)."""
    displacement_m: float
    """Distance that the centre of mass has moved [m]."""
    turn_rad: float
    """Angle that the object has turned [rad]."""
    joint: int = -1
    """Index of the joint that reaches its torque; -1 for all other events."""


@dataclass(frozen=True, slots=True, eq=False)
class _Limits:
    push_n: float
    motors: Motors

    def room(self, held: Equilibrium, load: Array) -> tuple[Array, Array]:
        """Return what is left to limits of pushes and, by (2), of torques, and what load takes."""
        grip, back = held.grip, held.rotation  # rows times R are turned back to the object's axes
        change = grip.response @ load
        turned = np.einsum("kij,kj->ki", grip.frames, change) @ back
        torques = self.motors.torques(grip.squeeze @ back)
        rates = self.motors.levers @ turned.ravel()
        pushes = self.push_n - grip.local_squeeze[:, 0]
        room = np.append(pushes, self.motors.limits - np.sign(rates) * torques)
        return room, np.append(change[:, 0], np.abs(rates))


def first_slip(
    grip: Grip,
    wrench: ArrayLike,
    *,
    model: SlipModel = "finite",
    max_push_n: float = math.inf,
    motors: Motors | None = None,
) -> FirstSlip:
    """Find the smallest multiple of a load at which a contact slips, without replanning.

    Args:
        grip: The squeezed contacts (see `grip`).
        wrench: External (force, torque), (6,) [N, N m], torque about the centre of mass, with axes
            that stay those of the world when the object turns.
        model: `finite` follows the object's motion; `linear` is the closed form of small motions.
        max_push_n: Largest normal force of a finger [N].
        motors: Joints that the contact forces load, with the torques of their motors. They may be
            reached before anything slips, which is the event `torque limit`; None for none.

    Returns:
        The multiple of the wrench, and what happens there. A grip that is unstable before any load
        has the multiple zero.

    Raises:
        InputError: The wrench is zero, a contact is not inside its friction cone at rest, or a
            joint not within its torque.
        SolverError: The equilibrium could not be followed.
    """
    check_grip(grip)
    load = frozen(wrench, (6,), "wrench")
    one_of(model, get_args(SlipModel), "model")
    number(max_push_n, "max_push_n", ge=SMALLEST, le=math.inf)
    if not SMALLEST <= float(np.abs(load).max()) <= LARGEST:
        raise InputError(
            f"wrench must not be zero: the largest part is from {SMALLEST:g} to {LARGEST:g}, got "
            f"{float(np.abs(load).max()):.6g}"
        )
    limits = _Limits(max_push_n, motors_for(motors, len(grip.friction)))
    _check_rest(grip, max_push_n)
    _check_torques(grip, limits.motors)
    rest = Equilibrium(grip, grip, np.zeros(3), np.eye(3))
    if not grip.stable:
        return _ended(rest, 0.0, "unstable", -1)
    if model == "finite":
        return _finite(rest, load, limits)
    multiple, event, place = _next_event(rest, load, limits)
    multiple = max(multiple, 0.0)
    if event == "none":
        return _ended(rest, multiple, event, place)
    motion = multiple * grip.compliance @ load
    local = grip.local_squeeze + multiple * (grip.response @ load)
    forces = np.einsum("kij,kj->ki", grip.frames, local)
    moved = Equilibrium(grip, grip.squeezed(forces), motion[:3], rotation(motion[3:]))
    return _ended(moved, multiple, event, place)


def _check_torques(grip: Grip, motors: Motors) -> None:
    torques = motors.torques(grip.squeeze)
    weak = np.flatnonzero(np.abs(torques) > motors.limits * (1.0 + REST_SLACK))
    if weak.size:
        joint = int(weak[0])
        raise InputError(
            f"squeeze: joint {joint} of the motors is too weak at rest: the squeeze asks for "
            f"{abs(torques[joint]):.6g} N m, but its limit is {motors.limits[joint]:.6g} N m; take "
            "the squeeze from best_squeeze with these motors"
        )


def _check_rest(grip: Grip, max_push_n: float) -> None:
    n, t = grip.local_squeeze[:, 0], np.linalg.norm(grip.local_squeeze[:, 1:], axis=1)
    slack = np.minimum(grip.friction * n - t, np.minimum(n, max_push_n - n))
    worst = int(np.argmin(slack))
    if slack[worst] < -REST_SLACK * float(np.abs(n).max()):
        raise InputError(
            f"squeeze: contact {worst} of the grip is not held at rest: it pushes with "
            f"{n[worst]:.6g} N (max_push_n is {max_push_n:.6g}) and has {t[worst]:.6g} N across, "
            f"at friction {grip.friction[worst]:.6g}; take the squeeze from best_squeeze"
        )


def slip_steps(local: Array, change: Array, friction: Array) -> Array:
    """Solve (1) for each contact: the least s >= 0 at which it slips, (..., k); else infinite."""
    return np.maximum(_steps_to_cone(local, change, friction), 0.0)


def _steps_to_cone(local: Array, change: Array, friction: Array) -> Array:
    """Solve (1); a step is negative where a contact is beyond its cone and goes on outwards."""
    (n, a), (t, b) = (local[..., 0], change[..., 0]), (local[..., 1:], change[..., 1:])
    # q2 s^2 + 2 q1 s + q0 is the squared cone less the squared tangential force
    mu2 = friction**2
    q2 = mu2 * a**2 - (b * b).sum(axis=-1)
    q1 = mu2 * n * a - (t * b).sum(axis=-1)
    q0 = mu2 * n**2 - (t * t).sum(axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        root = np.sqrt(np.maximum(q1**2 - q2 * q0, 0.0))
        # the root that comes first, in the form without cancellation
        falls = np.where(q1 <= 0.0, q0 / (root - q1), np.where(q2 < 0.0, (-q1 - root) / q2, np.inf))
        real = ((q1**2 >= q2 * q0) | (q0 < 0.0)) & ~((q1 >= 0.0) & (q2 >= 0.0))
        slips = np.where(real, falls, np.inf)
        # where the cone is left through its tip, no later
        lifts = np.where(a < 0.0, n / -a, np.inf)
    return np.minimum(np.where(np.isnan(slips), 0.0, slips), lifts)


def _next_event(held: Equilibrium, load: Array, most: _Limits) -> tuple[float, Event, int]:
    """Find how much the load grows to the next event, less than zero where it has passed it."""
    grip = held.grip
    slips = _steps_to_cone(grip.local_squeeze, grip.response @ load, grip.friction)
    room, rates = most.room(held, load)
    steps = np.full(len(room), np.inf)
    np.divide(room, rates, out=steps, where=rates > 0.0)
    if steps.min() < slips.min():
        place, pushes = int(np.argmin(steps)), len(slips)
        limited = "push limit" if place < pushes else "torque limit"
        return float(steps.min()), limited, place if place < pushes else place - pushes
    if math.isinf(slips.min()):
        return math.inf, "none", -1
    return float(slips.min()), "slip", int(np.argmin(slips))


def _finite(held: Equilibrium, load: Array, most: _Limits) -> FirstSlip:
    """Follow the equilibrium from rest until something happens, and back where it has happened."""
    reached, part = 0.0, 1.0
    farthest = LARGEST_LOAD * float(held.grip.local_squeeze[:, 0].max()) / float(np.abs(load).max())
    for _ in range(MOST_LOAD_STEPS):
        further, event, place = _next_event(held, load, most)
        further = max(further, -reached)
        is_within = further >= -SLIP_MET * reached
        if part < SMALLEST_STEP or (is_within and not held.grip.stable):
            return _ended(held, reached, "unstable", -1)
        if is_within and further <= SLIP_MET * reached:
            return _ended(held, reached, event, place)
        motion = held.grip.compliance @ load
        shift = float(np.linalg.norm(motion[:3])) / held.grip.size
        longest = part * LARGEST_STEP / max(shift, float(np.linalg.norm(motion[3:])))
        step = max(min(further, longest), -longest)
        if reached + step > farthest:
            return _ended(held, math.inf, "none", -1)
        try:
            moved = held.under((reached + step) * load)
        except SolverError:  # where the equilibrium ends no step is short enough
            part *= 0.5
            continue
        held, reached, part = moved, reached + step, min(1.0, 2.0 * part)
    raise SolverError("the load of first slip was not met; the grip may be nearly unstable")


def _ended(held: Equilibrium, multiple: float, event: Event, place: int) -> FirstSlip:
    joint = place if event == "torque limit" else -1
    contact = place if joint < 0 else -1
    cosine = 0.5 * (float(np.trace(held.rotation)) - 1.0)
    axis = held.rotation - held.rotation.T
    sine = 0.5 * math.hypot(axis[2, 1], axis[0, 2], axis[1, 0])
    return FirstSlip(
        multiple, event, contact, held.grip.squeeze, held.grip.arms, held.grip.normals,
        float(np.linalg.norm(held.moved)), math.atan2(sine, cosine), joint,
    )  # fmt: skip
