"""Chooses the wrenches that a grasp is tested with, and plans finger forces that balance them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array, cross, rounded, to_digits
from grasp_core.closure.contacts import contact_frictions, normal_and_tangential, stacked
from grasp_core.closure.soft_contacts import contact_torsions
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.quality.motors import Motors
from grasp_core.quality.wrench_limits import (
    WrenchBody,
    WrenchLimit,
    axis_wrenches,
    limit_of,
    weakest_from,
)
from grasp_core.values import Contact
from sim_validate.engine.limits import part
from sim_validate.engine.schedules import Load
from sim_validate.engine.setup import AXIS_NAMES, RANDOM, WEAKEST, Agenda, Setup

NO_PUSH = 1e-9
"""Normal forces below this share of the largest one count as zero."""


@dataclass(frozen=True, slots=True, eq=False)
class PlannedLoad:
    """One wrench that a grasp is tested with, and what the analysis predicts about it."""

    name: str
    load: Load
    """The wrench that is applied, and the finger forces planned for it."""
    predicted_limit: float
    limit: Load
    """The wrench at its predicted limit, and the finger forces that balance it."""
    required_friction: float
    """The friction coefficient that the planned forces need, with the torques of soft contacts."""


def planned_loads(
    body: Polyhedron,
    contacts: Sequence[Contact],
    friction: float,
    idle: Load,
    agenda: Agenda,
    setup: Setup,
    *,
    motors: Motors | None = None,
) -> tuple[PlannedLoad, ...]:
    """Plan all wrenches to test, in order: along axes, weakest, random, the user's own."""
    resisted, share = resisted_by(body, contacts, friction, setup, motors), setup.hold.load_share
    relative = [
        _load(name, found, share * found.limit, idle, body, contacts, setup)
        for name, found in _relative(resisted, body.radius, agenda)
    ]
    named = [(each.name, each.wrench) for each in agenda.wrenches]
    own = loads_as_they_are(body, contacts, friction, idle, named, setup, motors=motors)
    return (*relative, *own)


def loads_as_they_are(
    body: Polyhedron,
    contacts: Sequence[Contact],
    friction: float,
    idle: Load,
    wrenches: Sequence[tuple[str, Array]],
    setup: Setup,
    *,
    motors: Motors | None = None,
) -> tuple[PlannedLoad, ...]:
    """Plan finger forces for wrenches that are applied as given, not at a share of a limit."""
    resisted = resisted_by(body, contacts, friction, setup, motors)
    return tuple(
        _load(name, limit_of(resisted, wrench), 1.0, idle, body, contacts, setup)
        for name, wrench in wrenches
    )


def resisted_by(
    body: Polyhedron, contacts: Sequence[Contact], friction: float, setup: Setup,
    motors: Motors | None = None,
) -> WrenchBody:  # fmt: skip
    """Return the body of wrenches that contacts resist, with torques about the centre of mass."""
    positions, normals = stacked(contacts)
    frictions = contact_frictions(friction, len(contacts))
    return WrenchBody(
        positions - body.center_of_mass, normals, frictions, setup.fingers.max_normal_force_n,
        motors, torsions=contact_torsions(setup.physics.torsion_m, frictions),
    )  # fmt: skip


def _relative(
    resisted: WrenchBody, torque_scale: float, agenda: Agenda
) -> list[tuple[str, WrenchLimit]]:
    """Name the wrenches that are applied at a share of their limit, and compute each limit."""
    axes = [limit_of(resisted, wrench) for wrench in axis_wrenches(torque_scale)]
    weakest = weakest_from(resisted, axes, torque_scale)
    rng = np.random.default_rng(agenda.seed)
    scale = np.array([1.0] * 3 + [torque_scale] * 3)
    drawn = rng.normal(size=(agenda.random_wrenches, 6))
    units = scale * drawn / np.linalg.norm(drawn, axis=1, keepdims=True)
    others = [(RANDOM.format(place), limit_of(resisted, unit)) for place, unit in enumerate(units)]
    return [*zip(AXIS_NAMES, axes, strict=True), (WEAKEST, weakest), *others]


def _load(
    name: str, found: WrenchLimit, multiple: float, idle: Load, body: Polyhedron,
    contacts: Sequence[Contact], setup: Setup,
) -> PlannedLoad:  # fmt: skip
    """Plan a multiple of a wrench, with forces between those at rest and those at the limit.

    The friction that they need is the largest ratio of a tangential to a normal force.
    """
    wrench = to_digits(multiple * found.wrench)
    predicted = found.limit / multiple
    limit = Load(predicted * wrench, to_digits(found.forces))
    share = 1.0 / predicted if predicted > 0.0 else 0.0
    load = Load(wrench, part(idle, limit, share).forces if share else idle.forces)
    positions, normals = stacked(contacts)
    along, across = normal_and_tangential(load.forces, normals)
    pushing = along > NO_PUSH * along.max()
    along, across = along[pushing], across[pushing]
    if found.torques is not None:  # the normal force counts as far as the contact's torque leaves
        share = min(share, 1.0)
        # the torques about the normals, of least norm, that balance the load at rest
        missing = idle.wrench[3:] + cross(positions - body.center_of_mass, idle.forces).sum(axis=0)
        resting = np.asarray(np.linalg.lstsq(normals.T, -missing, rcond=None)[0], dtype=np.float64)
        torques = (1.0 - share) * resting + share * found.torques
        turning = np.abs(torques[pushing]) / setup.physics.torsion_m
        along = np.sqrt(np.maximum(along**2 - turning**2, (NO_PUSH * along) ** 2))
    required = rounded((across / along).max())
    return PlannedLoad(name, load, predicted, limit, required)
