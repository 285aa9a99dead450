"""Negative controls of an execution: grips that are weaker than chosen, under loads that must slip.

The load w is the least of the certified set that makes a contact slip under the chosen squeeze. The
weaker grips have less friction, less squeeze, or a finger that does not push. Most of them slip
before all of w has come, but an object that turns far may be held longer than small motions say.
`gc.first_slip` follows the large motions of the weaker grip, to a multiple s of w, and the load is
the larger of w and a quarter more than s w.

Where finger j leaves out its push p_j, the springs of all fingers share it. By (3) of `grips`, in
small motions and with the elastic stiffness K alone,

    f'_i = f_i - K_i W_i' x - [i = j] p_j,   K x = -W_j p_j.                              (1)

Where (1) leaves a cone, a contact slides while the fingers close, and that counts as a slip.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from grasp_core.arrays import Array
from grasp_core.closure.contacts import grasp_map
from grasp_core.errors import InputError, SolverError
from grasp_core.execution.first_slip import first_slip
from grasp_core.execution.grips import Grip
from grasp_core.execution.loads import Reactions
from grasp_core.execution.squeeze_certificate import BestSqueeze
from grasp_core.solvers.ties import first_best
from scenes.mujoco.held import HeldLayout
from sim_validate.execution import paths
from sim_validate.execution.bench import SLID, HeldBench, HeldMotion, outcome, seen, slides
from sim_validate.execution.paths import Drive, joined
from sim_validate.execution.verdict import ExecutionControl

FRICTION = 0.9
SQUEEZE = 0.9
"""Friction and squeeze of the controls, relative to the trials'."""
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
    layout = bench.scene.layout
    rise_s = min(max(2.0 * paths.RISE_S, FOLLOWED / lowest_frequency), LONGEST_RISE_S)
    share = paths.smooth(paths.samples(rise_s))
    closing, loading = paths.closing(), paths.loaded(share, np.zeros(3))
    weaker, drives = tuple(weaker_grips(best, layout)), list[Drive]()
    for each in weaker:
        drive = joined(closing, replace(loading, wrenches=share[:, None] * each.load))
        drives.append(replace(drive, grasping=np.outer(drive.grasping, each.pushing)))
    motions = bench.run(drives, friction=np.array([each.friction for each in weaker]))
    return tuple(
        _judged(each, motion, layout, drive, len(closing) - 1)
        for each, motion, drive in zip(weaker, motions, drives, strict=True)
    )


def _judged(
    weaker: Weaker, motion: HeldMotion, layout: HeldLayout, drive: Drive, begun: int
) -> ExecutionControl:
    """Say whether a contact slipped under the load, or while fingers closed and one was idle."""
    found = outcome(motion, layout, drive, weaker.friction, begun)
    if weaker.idle:
        closing = slides(seen(motion, layout), layout)[: begun + 1]
        if float(closing.max()) > SLID * layout.radius_m:
            return ExecutionControl(weaker.name, let_go=True, first_slip=0.0)
    return ExecutionControl(weaker.name, found.slipped, found.first_slip)


def weaker_grips(best: BestSqueeze, layout: HeldLayout) -> Iterator[Weaker]:
    """Yield the weaker grips of a chosen squeeze, with their loads."""
    grip, load = best.grip, slipping_load(best)
    all_push = np.ones(len(grip.friction))
    little = replace(grip, friction=FRICTION * grip.friction)
    yield Weaker(f"friction {FRICTION:g}", little.friction, all_push, _sure(little, load) * load)
    loose, pushing = grip.squeezed(SQUEEZE * grip.squeeze), SQUEEZE * all_push
    yield Weaker(f"squeeze {SQUEEZE:g}", grip.friction, pushing, _sure(loose, load) * load)
    strongest = first_best(layout.pushes.max(axis=1))
    others_push = all_push.copy()
    others_push[strongest] = 0.0
    left = idle(grip, strongest, layout.axes[strongest] @ layout.pushes[strongest])
    name = "a finger that does not push"
    yield Weaker(name, grip.friction, others_push, _sure(left, load) * load, True)


def _sure(weaker: Grip, load: Array) -> float:
    """Return the multiple of a load, at least one, that makes a weaker grip slip by analysis.

    It is one where the grip slips at rest already, is unstable, never slips by analysis, or cannot
    be followed; then nothing shows that the load suffices.
    """
    try:
        found = first_slip(weaker, load)
    except (InputError, SolverError):
        return 1.0
    return max(1.0, SURE * found.multiple) if np.isfinite(found.multiple) else 1.0


def idle(grip: Grip, finger: int, push: Array) -> Grip:
    """Return the squeeze that is left by (1) where a finger does not push."""
    maps = grasp_map(grip.arms).reshape(len(grip.elastic_stiffness), -1, 3).transpose(1, 0, 2)
    motion = np.asarray(np.linalg.solve(grip.elastic_stiffness, -maps[finger] @ push), dtype=float)
    squeeze = grip.squeeze - np.einsum("kij,kmj,m->ki", grip.stiffness, maps, motion)
    squeeze[finger] -= push
    return grip.squeezed(squeeze)


def slipping_load(best: BestSqueeze) -> Array:
    """Return the least load of a set that makes a contact slip, (6,) [N, N m].

    It is larger than the worst certified load where a finger reaches its largest push before any
    contact slips: the simulated fingers push as hard as their springs do.
    """
    reactions = Reactions.of(best.grip, best.loads)
    angles, scales = reactions.worst_angles()
    contact = first_best(-scales)
    direction = reactions.worst_of(contact, float(angles[contact]))
    return best.loads.offset + float(scales[contact]) * best.loads.axes @ direction
