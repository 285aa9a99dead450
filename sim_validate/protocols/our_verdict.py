"""What we say about the loads of a published test: closure, the predicted margin, and our trials.

Our trials are those of closure tests: forces are planned for each load, friction is Coulomb's to a
per mille, and the object must stay within micrometres. Contacts that are not in force closure need
no trial: that they let go of some load is proved.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array
from grasp_core.closure.force_closure import force_closure
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.quality.motors import Motors
from grasp_core.values import Contact
from scenes.mjcf import Scene
from sim_validate.simulation.hold_verdict import Outcome, judge
from sim_validate.simulation.loads import PlannedLoad, loads_as_they_are
from sim_validate.simulation.rig import Rig, squeezed
from sim_validate.simulation.setup import Setup
from sim_validate.simulation.simulate import Bench


@dataclass(frozen=True, slots=True)
class OurVerdict:
    """Our verdict on the loads of a published test, with the prediction."""

    closed: bool
    """Whether the contacts are in force closure, which is proved either way."""
    held: bool
    """Whether the object stayed within our thresholds under every load; False without closure."""
    margin: float
    """Least multiple of the loads that is resisted according to the analysis; 0 without closure,
    and infinite without a load."""
    reason: str
    """Why it was not held; empty if it was."""


def our_verdict(
    body: Polyhedron,
    contacts: Sequence[Contact],
    friction: float,
    forces: Sequence[Array],
    setup: Setup,
    scene: Callable[[], Scene],
    motors: Motors | None = None,
) -> OurVerdict:
    """Predict the least multiple of forces that contacts resist, and hold the forces in simulation.

    Takes `forces` (3,) [N].
    """
    if not force_closure(contacts, friction=friction, torsion_m=setup.torsion_m).closed:
        told = f"the contacts are proved not to be in force closure at friction {friction:g}"
        return OurVerdict(False, False, 0.0, told)
    bench = Bench(scene(), threads=setup.threads, timeout_s=setup.timeout_s)
    layout = bench.scene.layout
    rig = squeezed(bench, setup, layout.squeeze_forces, friction)
    named = [(_name(force), np.concatenate([force, np.zeros(3)])) for force in forces]
    loads = loads_as_they_are(body, contacts, friction, rig.idle, named, setup, motors=motors)
    margin = min((load.predicted_limit for load in loads), default=math.inf)
    reason = _not_held(rig, loads, setup)
    return OurVerdict(True, not reason, margin, reason)


def _name(force: Array) -> str:
    x, y, z = force.tolist()
    return f"{x:.3g} {y:.3g} {z:.3g} N"


def _not_held(rig: Rig, loads: Sequence[PlannedLoad], setup: Setup) -> str:
    """Hold all loads, or none at all where there are none; say what was not held."""
    held = [each.load for each in loads] or [rig.idle]
    names = [each.name for each in loads] or ["no load"]
    for name, trace in zip(names, rig.hold(held), strict=True):
        found = judge(trace, rig.bench.scene.layout, setup.hold)
        if found.outcome is not Outcome.HELD:
            return f"{name}: {found.outcome.value}: {found.reason}"
    return ""
