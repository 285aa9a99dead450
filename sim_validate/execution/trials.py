"""Which trials an execution consists of, what each applies, and where object and fingertips are.

In `misplaced` the object is moved by a stated distance and turned by a stated angle, both in
directions drawn by a seed, or by errors that are drawn too. Each fingertip comes along its normal
until it touches, as far behind its planned place as the object can have moved; one that meets
nothing stops as far beyond it (see `misplacement`). From there the squeeze is commanded as planned.

In `lift` the object rests on a table, on a face of its convex hull that carries its centre of mass:
the centre, dropped onto the face, lies inside. An object that is thrown and settles without sliding
comes to rest on a face about as often as the solid angle says under which the centre of mass sees
the face, so faces are tried in this order.

Negative controls are grips that are weaker than chosen, under loads that must slip. The load w is
the least of the certified set that makes a contact slip under the chosen squeeze. Weaker grips have
less friction, less squeeze, or a finger that does not push. Most of them slip before all of w has
come, but an object that turns far may be held longer than small motions say. `gc.first_slip`
follows the large motions of the weaker grip, to a multiple s of w, and the load is the larger of w
and a quarter more than s w.

Where finger j leaves out its push p_j, the springs of all fingers share it. By (3) of `grips`, in
small motions and with the elastic stiffness K alone,

    f'_i = f_i - K_i W_i' x - [i = j] p_j,   K x = -W_j p_j.                              (1)

Where (1) leaves a cone, a contact slides while the fingers close, and that counts as a slip.
"""

import importlib
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from grasp_core.arrays import Array
from grasp_core.errors import InputError, SolverError
from grasp_core.execution.first_slip import first_slip
from grasp_core.execution.grips import Grip
from grasp_core.execution.loads import GRAVITY_M_PER_S2, Reactions
from grasp_core.execution.squeeze_certificate import BestSqueeze
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.objects.shells import solid_angles
from grasp_core.solvers.ties import first_best, largest_first
from scenes.mujoco.held_scene import HeldLayout
from sim_validate.engine.misplacement import closed_there, drawn_errors, misplaced_poses, tips_met
from sim_validate.execution import paths
from sim_validate.execution.paths import TablePlane, TrialDrive
from sim_validate.execution.simulate import SLIPPED_BY, HeldBench, HeldMotion, outcome
from sim_validate.execution.verdict import ExecutionControl, Skipped
from sim_validate.settings import ExecutionSettings, TrialKind

FACET_SLACK = 1e-6
"""Difference of normals, and of offsets in object radii, up to which facets are one face."""
TABLE_GAP = 0.01
"""Least gap between fingertips and the table, in object radii."""


@dataclass(frozen=True, slots=True, eq=False)
class Rest:
    """A face of the convex hull on which the object can rest."""

    down: Array
    """Unit normal out of the object."""
    height: float
    likelihood: float
    """Share of the sphere that the face takes, as the centre of mass sees it."""


def rests(body: Polyhedron) -> tuple[Rest, ...]:
    """Return the faces on which an object can rest, the likeliest first."""
    spatial: Any = importlib.import_module("scipy.spatial")
    points = (body.vertices - body.center_of_mass) / body.radius
    hull = spatial.ConvexHull(points)
    normals, offsets = hull.equations[:, :3], -hull.equations[:, 3]
    left = set(range(len(normals)))
    found = list[Rest]()
    for first in range(len(normals)):
        if first not in left:
            continue
        alike = (np.abs(normals - normals[first]).max(axis=1) <= FACET_SLACK) & (
            np.abs(offsets - offsets[first]) <= FACET_SLACK
        )
        own = [facet for facet in np.flatnonzero(alike) if facet in left]
        left -= set(own)
        # the origin, dropped along the normal, stays on the inner side of all other faces
        foot = offsets[first] * normals[first]
        if (alike | (normals @ foot <= offsets)).all():
            corners = points[hull.simplices[own]].transpose(2, 1, 0)
            angles = solid_angles(corners, np.zeros((1, 3)))
            share = float(np.abs(angles).sum() / (4.0 * np.pi))
            found.append(Rest(normals[first], float(offsets[first]) * body.radius, share))
    order = largest_first([rest.likelihood for rest in found])
    return tuple(found[place] for place in order)


def resting(body: Polyhedron, tips: Array, radii: Array) -> Rest | None:
    """Return the likeliest rest in which no fingertip meets the table; None if there is none."""
    for rest in rests(body):
        if (tips @ rest.down + radii).max() <= rest.height - TABLE_GAP * body.radius:
            return rest
    return None


AXIS_LETTERS = ("x", "y", "z")
AXIS_SIDES = tuple((sign, axis) for axis in range(3) for sign in (1.0, -1.0))
"""Sign and axis of the six directions of stops and knocks."""
OF_NO_SIZE: dict[TrialKind, str] = {"shake": "shake_g", "knock": "knock_n_s"}
"""Setting whose zero leaves no trial of a kind."""


@dataclass(frozen=True, slots=True, eq=False)
class Trial:
    """One trial: what is applied, and from when on the object must stay where it is."""

    kind: TrialKind
    name: str
    drive: TrialDrive
    begun: int
    apart: bool = False
    """Whether the trial starts with open fingers, not from the squeezed object."""
    weighing: int = 0
    """Number of samples at the start in which the weight comes, as in other trials of the grasp."""
    turning: bool = False
    """Whether the load keeps turning, so that small slips add up."""
    expected: TrialDrive | None = None
    """What the prediction is for, if not for the drive itself."""
    starts_closed: bool | None = None
    """Whether fingertips first meet a misplaced object in force closure."""


def trials_of(
    body: Polyhedron, layout: HeldLayout, settings: ExecutionSettings, lowest_frequency: float
) -> tuple[tuple[Trial, ...], tuple[Skipped, ...]]:
    """Return the trials that are asked for, and the kinds that are left out with the reasons."""
    found, skipped = list[Trial](), list[Skipped]()
    sized = {"shake": _shakes, "stop": _stops, "knock": _knocks, "misplaced": _misplaced}
    for kind in settings.trials:
        if (size := OF_NO_SIZE.get(kind)) and getattr(settings, size) == 0.0:
            flag = size.replace("_", "-")
            skipped.append(Skipped(kind, f"its size is 0 ({size}, --{flag})"))
        elif kind == "weight":
            drive = paths.turned_weight(lowest_frequency)
            found.append(Trial(kind, kind, drive, 0, turning=True))
        elif kind == "lift":
            lift = _lift(body, layout, settings)
            found += [lift] if isinstance(lift, Trial) else []
            skipped += [lift] if isinstance(lift, Skipped) else []
        else:
            found += sized[kind](layout, settings)
    return tuple(found), tuple(skipped)


def _lift(body: Polyhedron, layout: HeldLayout, settings: ExecutionSettings) -> Trial | Skipped:
    rest = resting(body, *layout.holder.above_table)
    if rest is None:
        return Skipped(
            "lift", "a fingertip is in the way of the table on every face that the object rests on"
        )
    give_m = layout.object_kg * GRAVITY_M_PER_S2 / layout.stiffness_along(rest.down)
    drive, begun = paths.lift(-rest.down, settings.lift_m, settings.lift_s, give_m)
    table = TablePlane(rest.height * rest.down, -rest.down)
    return Trial("lift", "lift", replace(drive, table=table), begun - 1, apart=True)


def _shakes(layout: HeldLayout, settings: ExecutionSettings) -> Iterator[Trial]:
    size = GRAVITY_M_PER_S2 * settings.shake_g
    sizes = np.repeat([size, size / layout.radius_m], len(AXIS_LETTERS))
    names = [f"shake {how} {axis}" for how in ("along", "about") for axis in AXIS_LETTERS]
    for name, axis in zip(names, np.diag(sizes), strict=True):
        drive = paths.shake(layout.gravity, axis, settings.shake_hz)
        yield Trial("shake", name, drive, 0, weighing=paths.WEIGHING)


def _stops(layout: HeldLayout, settings: ExecutionSettings) -> Iterator[Trial]:
    for sign, axis in AXIS_SIDES:
        way = sign * np.eye(3)[axis]
        drive = paths.stop(layout.gravity, way, settings.stop_m_per_s2, settings.stop_from_m_per_s)
        yield Trial("stop", f"stop {_side(sign, axis)}", drive, 0, weighing=paths.WEIGHING)


def _knocks(layout: HeldLayout, settings: ExecutionSettings) -> Iterator[Trial]:
    """Yield knocks along both sides of each axis, half the object's radius beside its middle."""
    for sign, axis in AXIS_SIDES:
        point = 0.5 * layout.radius_m * np.eye(3)[(axis + 1) % 3]
        drive = paths.knock(layout.gravity, sign * settings.impulse_n_s * np.eye(3)[axis], point)
        yield Trial("knock", f"knock {_side(sign, axis)}", drive, 0, weighing=paths.WEIGHING)


def _misplaced(layout: HeldLayout, settings: ExecutionSettings) -> Iterator[Trial]:
    off_m, off_rad = settings.off_mm / 1000.0, math.radians(settings.off_deg)
    off = drawn_errors(settings.misplacements, settings.seed, settings.off_by)
    poses = misplaced_poses(layout, off_m * off[:, 0], off_rad * off[:, 1])
    farthest, widest = np.linalg.norm(off, axis=2).max(axis=0)
    reached = tips_met(layout, poses, float(farthest) * off_m, float(widest) * off_rad)
    closing, weight = paths.closing(), paths.weighed(layout.gravity)
    for place, (pose, tips) in enumerate(zip(poses, reached, strict=True)):
        drive = replace(closing.then(weight), pose=pose, reached=tips)
        name = f"misplaced {place}"
        yield Trial(
            "misplaced", name, drive, len(closing) - 1, apart=True, expected=weight,
            starts_closed=closed_there(layout, pose, tips),
        )  # fmt: skip


def _side(sign: float, axis: int) -> str:
    return f"{'+' if sign > 0.0 else '-'}{AXIS_LETTERS[axis]}"


GRIP_SHARE = 0.9
"""Friction, or squeeze, of a control, relative to the trials'."""
SURE = 1.25
"""Load of a control, relative to that at which the analysis says that it slips: fingertips that
roll to an edge of their face hold up to a tenth more."""
FOLLOWED = 12.0
"""Duration of a rise that the held object follows, in reciprocals of its lowest frequency."""
LONGEST_RISE_S = 10.0
"""Longest rise that is simulated: objects of tonnes on soft springs would take minutes [s]."""


@dataclass(frozen=True, slots=True, eq=False)
class Weaker:
    """A grip that is weaker than chosen, and the load under which it must slip."""

    name: str
    friction: Array
    pushing: Array
    """Share of its command that each finger pushes with, (k,)."""
    load: Array
    idle: bool = False
    """Whether a finger does not push, so that a slide while the others close counts as well."""


def run_controls(
    bench: HeldBench, best: BestSqueeze, lowest_frequency: float
) -> tuple[ExecutionControl, ...]:
    """Simulate the weaker grips under loads that grow slowly and must make a contact slip."""
    rise_s = min(max(2.0 * paths.RISE_S, FOLLOWED / lowest_frequency), LONGEST_RISE_S)
    share = paths.smooth(paths.samples(rise_s))
    closing, loading = paths.closing(), paths.loaded(share, np.zeros(3))
    weaker, drives = tuple(weaker_grips(best, bench.scene.layout)), list[TrialDrive]()
    for each in weaker:
        drive = closing.then(replace(loading, wrenches=share[:, None] * each.load))
        grasping = np.outer(drive.grasping, each.pushing)
        drives.append(replace(drive, grasping=grasping, friction=each.friction))
    motions = bench.run(drives)
    return tuple(
        _judged(each, motion, drive, len(closing) - 1)
        for each, motion, drive in zip(weaker, motions, drives, strict=True)
    )


def _judged(weaker: Weaker, motion: HeldMotion, drive: TrialDrive, begun: int) -> ExecutionControl:
    """Say whether a contact slipped under the load, or while fingers closed and one was idle."""
    found = outcome(motion, drive, weaker.friction, begun)
    if weaker.idle:
        closing = motion.slides()[: begun + 1]
        if float(closing.max()) > SLIPPED_BY * motion.layout.radius_m:
            return ExecutionControl(weaker.name, let_go=True, first_slip=0.0)
    return ExecutionControl(weaker.name, found.slipped, found.first_slip)


def weaker_grips(best: BestSqueeze, layout: HeldLayout) -> Iterator[Weaker]:
    """Yield the weaker grips of a chosen squeeze, with their loads."""
    grip, load = best.grip, slipping_load(best)
    all_push = np.ones(len(grip.friction))
    little = replace(grip, friction=GRIP_SHARE * grip.friction)
    yield Weaker(f"friction {GRIP_SHARE:g}", little.friction, all_push, _sure(little, load) * load)
    loose, pushing = grip.squeezed(GRIP_SHARE * grip.squeeze), GRIP_SHARE * all_push
    yield Weaker(f"squeeze {GRIP_SHARE:g}", grip.friction, pushing, _sure(loose, load) * load)
    strongest = first_best(layout.pushes.max(axis=1))
    others_push = all_push.copy()
    others_push[strongest] = 0.0
    left = without_push(grip, strongest, layout.axes[strongest] @ layout.pushes[strongest])
    name = "a finger that does not push"
    yield Weaker(name, grip.friction, others_push, _sure(left, load) * load, True)


def _sure(weaker: Grip, load: Array) -> float:
    """Return the multiple of a load, at least one, that makes a weaker grip slip by analysis."""
    try:
        found = first_slip(weaker, load)
    except (InputError, SolverError):  # nothing shows that the load suffices
        return 1.0
    return max(1.0, SURE * found.multiple) if np.isfinite(found.multiple) else 1.0


def without_push(grip: Grip, finger: int, push: Array) -> Grip:
    """Return the squeeze that is left by (1) where a finger does not push."""
    load = -grip.maps[finger] @ push
    motion = np.asarray(np.linalg.solve(grip.elastic_stiffness, load), dtype=np.float64)
    squeeze = grip.squeeze - np.einsum("kij,kmj,m->ki", grip.stiffness, grip.maps, motion)
    squeeze[finger] -= push
    return grip.squeezed(squeeze)


def slipping_load(best: BestSqueeze) -> Array:
    """Return the least load of a set that makes a contact slip, (6,), whatever the largest push."""
    reactions = Reactions.of(best.grip, best.loads)
    angles, scales = reactions.worst_angles()
    contact = first_best(-scales)
    direction = reactions.worst_of(contact, float(angles[contact]))
    return best.loads.offset + float(scales[contact]) * best.loads.axes @ direction
