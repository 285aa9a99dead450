"""Checks executions on a box that nothing holds, and on one that a table carries.

Without fingers the box falls by g t^2 / 2, and a knock with impulse J and moment L about its axis z
gives it the velocity J / m and the rate of turning L / I_z. A table under the box carries m g
until the fingers lift the box, and nothing afterwards.
"""

import math
from dataclasses import replace

import numpy as np

from grasp_core.execution.loads import GRAVITY_M_PER_S2
from scenes.execution.held_mjcf import AWAY, SAMPLE_S
from sim_validate.execution import paths
from sim_validate.execution.bench import HeldBench
from sim_validate.execution.drives import Drive, Table, idle
from sim_validate.execution.gate.held_case import DOWN, FINGERS, WEIGHT, HeldCase, known, near
from sim_validate.simulation.known_cases import Check

FALL_S = 0.4
"""Time of the fall: steps of h make it h / FALL_S longer, a third of a percent at 1.25 ms [s]."""
FLIGHT_S = 0.2
"""Time in which the box flies after a knock [s]."""
KNOCK_RAD_PER_S = 2.0
"""Rate of turning after a knock: the box turns by less than half a radian in its flight."""
APART = 2.0
"""Distance of the fingers from their contacts, in radii of the box."""
RAISED = 4.0
"""Height of the lift, relative to the way by which the springs give under the weight."""


def free_box(case: HeldCase) -> tuple[Check, ...]:
    """Check the fall, the velocities after a knock, and what a table carries."""
    bench = HeldBench(case.held_box())
    fall, knock = bench.run([_fall(case, bench), _knock(case, bench)])
    steps = round(FALL_S / SAMPLE_S)
    fallen = float(fall.moved[-1] @ DOWN) / (0.5 * GRAVITY_M_PER_S2 * (steps * SAMPLE_S) ** 2)
    time = (len(knock.moved) - 2) * SAMPLE_S
    speed = float(knock.moved[-1, 0] - knock.moved[1, 0]) / time
    turns = 2.0 * np.arctan2(knock.turned[:, 3], knock.turned[:, 0])
    rate = float(turns[-1] - turns[1]) / time
    return (
        near("fall of a box that nothing holds, over g t^2 / 2", known(fall, fallen)),
        near("velocity after a knock, over J / m", known(knock, speed / _speed(case))),
        near("rate of turning after a knock, over L / I", known(knock, rate / KNOCK_RAD_PER_S)),
        *_lifted(case, bench),
    )


def _apart(case: HeldCase, bench: HeldBench, drive: Drive) -> Drive:
    """Take the fingers and the table away from the box; the table faces it from above."""
    layout = bench.scene.layout
    back = -APART * case.radius_m * layout.frames[:, :, 0]
    reached = np.einsum("kij,ki->kj", layout.axes, back)
    above = Table(-AWAY * case.radius_m * DOWN, DOWN)
    return replace(drive, grasping=np.zeros(len(drive)), reached=reached, table=above)


def _fall(case: HeldCase, bench: HeldBench) -> Drive:
    count = round(FALL_S / SAMPLE_S)
    return _apart(case, bench, replace(idle(count), gravity=np.tile(WEIGHT, (count, 1))))


def _knock(case: HeldCase, bench: HeldBench) -> Drive:
    count = round(FLIGHT_S / SAMPLE_S)
    wrenches = np.zeros((count, 6))
    wrenches[0, 0] = case.mass_kg * _speed(case) / SAMPLE_S
    wrenches[0, 5] = bench.scene.layout.inertia_kg_m2[2, 2] * KNOCK_RAD_PER_S / SAMPLE_S
    return _apart(case, bench, replace(idle(count), wrenches=wrenches))


def _lifted(case: HeldCase, bench: HeldBench) -> tuple[Check, Check]:
    """Lift the box off a table, with a weight that its springs carry lightly."""
    weight = min(case.mass_kg * GRAVITY_M_PER_S2, case.light_n)
    height = RAISED * weight / (FINGERS * case.stiffness_n_per_m)
    drive, begun = paths.lift(-DOWN, height, SAMPLE_S * len(case.rise))
    share = weight / (case.mass_kg * GRAVITY_M_PER_S2)
    table = Table(case.halves[2] * DOWN, -DOWN)
    (motion,) = bench.run([replace(drive, gravity=share * drive.gravity, table=table)])
    still = paths.samples(0.5 * paths.REST_S)
    carried = -(motion.table @ DOWN) / weight
    before = float(carried[begun - still : begun].mean())
    after = float(np.abs(carried[-still:]).max())
    return (
        near("weight that a table carries before a lift, over m g", known(motion, before)),
        Check("weight that a table carries after a lift, over m g",
              known(motion, after if math.isfinite(after) else math.nan), 0.0, 0.01),
    )  # fmt: skip


def _speed(case: HeldCase) -> float:
    """Return the speed after a knock: it takes the box by one radius, not as far as the fingers."""
    return case.radius_m / FLIGHT_S
