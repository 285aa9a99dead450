"""Makes what a dataset has on request: executions, figures, and varied grasps.

Varied grasps are natural negatives, and natural positives beside them: nothing but the analysis and
the simulation tells which of them hold. Friction is drawn below, near and above the critical one.
Contacts move on their faces along a random direction, beyond where the region ends in it, so that
the region promises nothing any more. The mass is drawn around the one at which the object is
predicted to be lost. All draws depend on the seed and the grasp's name alone.

A cell is null where its figure does not exist for the contacts: fewer than four have no span angle,
contacts that are not in force closure no witness forces.
"""

import math
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np

from grasp_core.allowed_values import LARGEST_FRICTION
from grasp_core.arrays import Array
from grasp_core.closure.closure_certificate import ClosureCertificate
from grasp_core.closure.contacts import contacts_sha256, stacked
from grasp_core.closure.critical_friction import critical_friction
from grasp_core.cones.spanning import span_angle
from grasp_core.errors import GraspError, InputError, NoForcesError, SolverError, UndecidedError
from grasp_core.execution.best_squeeze import best_squeeze
from grasp_core.execution.loads import any_direction
from grasp_core.geometry.polygons import convex_hull, edge_rows, plane_frame
from grasp_core.objects.on_faces import within
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.planning.given_contacts import Seated, grasp_of, seat
from grasp_core.quality.metrics import smallest_singular_value
from grasp_core.regions.certify_placement import usual_bound
from grasp_core.values import FINGERS, Contact, ContactRegion, Grasp, four
from sim_validate.closure.controls import LEAST_CONTROL_FRICTION, negative_controls, try_control
from sim_validate.closure.validate import validate
from sim_validate.closure.verdict import Verdict
from sim_validate.datasets.columns import ExecutionCells, ExecutionRow, GraspRow
from sim_validate.datasets.config import DatasetConfig, Learning
from sim_validate.datasets.parquet import RowCells
from sim_validate.engine.misplacement import draws_by_name
from sim_validate.engine.setup import Agenda, Setup
from sim_validate.execution.execute import execute
from sim_validate.execution.holders import tip_radius
from sim_validate.execution.verdict import ExecutedGrasp, ExecutionTrial
from sim_validate.settings import TrialKind

Executed: TypeAlias = ExecutedGrasp | str | None
"""An execution, the reason why it was refused, or None where none is asked for."""
MISPLACED: TrialKind = "misplaced"


def execution_cells(executed: Executed) -> dict[str, Any]:
    """Return the cells of a grasp's row that are about its execution, by column.

    Where no squeeze holds the object, the grasp did not survive. Where the execution was refused,
    or no trial is possible, it is not known whether the grasp survives.
    """
    if executed is None:
        return {}
    if isinstance(executed, str):
        return {"executed": False, "execution_note": executed}
    found = executed.execution
    if found is None:
        return {"executed": False, "survived": False, "execution_note": executed.reason}
    trials = found.trials
    return {
        "executed": True,
        "execution_note": "; ".join(f"{each.kind}: {each.reason}" for each in found.skipped),
        "mass_kg": found.mass_kg,
        "squeeze_n": found.squeeze,
        "load_multiple": found.load_multiple,
        **trial_cells(trials),
        "payload_kg": found.payload_kg,
        "execution_mismatches": sum(not each.let_go for each in found.controls),
        "execution": ExecutionCells.of(found),
    }


def trial_cells(trials: Sequence[ExecutionTrial]) -> dict[str, Any]:
    """Return the cells of a grasp's row that follow from the trials of its execution."""
    return {
        "survived": all(each.survived for each in trials) if trials else None,
        "predicted_first_slip": min((each.predicted_first_slip for each in trials), default=None),
        "simulated_first_slip": min((each.simulated_first_slip for each in trials), default=None),
        "predicted_loss": min((each.predicted_loss for each in trials), default=None),
        "executed_trials": len(trials),
    }


def executed_by(
    config: DatasetConfig, body: Polyhedron, contacts: Sequence[Contact], friction: float,
    name: str, mass_kg: float | None = None,
) -> Executed:  # fmt: skip
    """Execute contacts, and once more for each seed asked for with objects misplaced by it.

    Contacts without a squeeze are a result with a reason.
    """
    if config.execution is None:
        return None
    about = name, "", contacts_sha256(contacts)
    try:
        settings = config.execution.for_body(body)
        if mass_kg is not None:
            settings = replace(settings, mass_kg=mass_kg)
        first = execute(body, contacts, friction, settings, enough=False)
    except NoForcesError as error:
        return ExecutedGrasp(*about, None, str(error))
    except InputError as error:
        return str(error)
    trials = list(first.trials)
    seeds = config.asked.seeds if MISPLACED in settings.trials else ()
    for place, seed in enumerate(seeds, start=1):
        again = replace(settings, trials=(MISPLACED,), seed=seed)
        more = execute(body, contacts, friction, again, enough=False).trials
        trials += [
            replace(trial, name=f"{MISPLACED} {place * settings.misplacements + number}")
            for number, trial in enumerate(more)
        ]
    return ExecutedGrasp(*about, replace(first, trials=tuple(trials)))


def execution_rows(name: str, executed: Executed, config: DatasetConfig) -> Iterator[ExecutionRow]:
    """Yield a row for each trial of an execution, each misplaced one with its seed."""
    asked = config.execution
    if asked is None or not isinstance(executed, ExecutedGrasp):
        return
    seeds = (seed for seed in (asked.seed, *config.asked.seeds) for _ in range(asked.misplacements))
    for number, trial in enumerate(executed.trials):
        yield ExecutionRow(name, number, trial, next(seeds) if trial.kind == MISPLACED else None)


def contact_cells(config: DatasetConfig, body: Polyhedron, contacts: Sequence[Contact]) -> RowCells:
    """Return the figures on request that any contacts have, closed or not."""
    if "closure" not in config.asked.figures:
        return {}
    points, normals = stacked(contacts)
    angle = span_angle(normals) if len(contacts) == FINGERS else None
    smallest = None
    with suppress(GraspError):  # too few contacts span too little
        smallest = smallest_singular_value(
            points, center=body.center_of_mass, torque_scale=body.radius
        )
    return {"span_angle_rad": angle, "smallest_singular_value": smallest}


def placement_cells(
    config: DatasetConfig, body: Polyhedron, grasp: Grasp, friction: float
) -> RowCells:
    """Return the proved chance of closure of a misplaced grasp, if it is asked for."""
    if "placement" not in config.asked.figures:
        return {}
    bounded = usual_bound(body, grasp, friction)
    missing = isinstance(bounded, str)
    return {"closed_share_reason": bounded} if missing else {"closed_share": bounded.lower}


def squeeze_cells(config: DatasetConfig, body: Polyhedron, row: GraspRow) -> RowCells:
    """Return the figures on request that only executed contacts have."""
    if config.execution is None or row.mass_kg is None:
        return {}
    settings = config.execution.for_body(body)
    cells: dict[str, Any] = {"tip_radius_m": tip_radius(body, row.placed, settings)}
    if "least_squeeze" in config.asked.figures:
        with suppress(GraspError):  # no push carries the weight every way, or it is unstable
            least = best_squeeze(
                body, row.placed, row.friction, any_direction(row.mass_kg),
                stiffness=settings.tip_stiffness_n_per_m, tip_radius_m=cells["tip_radius_m"],
            )  # fmt: skip
            cells |= {"least_push_n": least.max_push_n, "least_squeeze_n": least.grip.squeeze}
    return cells


VARIED_RATIOS = {
    "friction_below": (0.6, 0.9),
    "friction_near": (0.95, 1.05),
    "friction_above": (1.1, 5.0),
    "mass_near": (0.6, 1.6),
}
"""Least and largest ratio of a varied friction or mass to the one at which the verdict changes.
Between them every logarithm of a ratio is as likely."""
VARIED_DIGITS = 4
MOVE_TRIES = 32
"""Number of random ways in which a contact is moved until it stays on its face."""
PAST = (0.05, 1.0)
"""How far past its region's end a contact moves, over the way to there or `LEAST_WAY`."""
UNMOVED: RowCells = {"displaced_m": (0.0,) * FINGERS, "region_exit_m": (None,) * FINGERS}
"""What rows say where no contact moved: the regions' ends are not known then."""
LEAST_WAY = 0.1
"""Least way that a contact's move is measured by, in object radii: regions may be points."""


@dataclass(frozen=True, slots=True, eq=False)
class Variant:
    """A varied grasp, with the proof that it is in force closure or that it is not."""

    name: str
    """Kind and number, which no other variant of the grasp has."""
    seated: Seated
    """The contacts and their object."""
    friction: float
    proved: Grasp | ClosureCertificate
    cells: RowCells
    """What its row says of how it was varied."""
    mass_kg: float | None = None
    """Mass of the object in the execution; None for the mass of the settings [kg]."""


def ratio_of(friction: float, critical: float | None) -> float | None:
    """Return the ratio of a friction to a critical one, if that is known and above zero."""
    return friction / critical if critical else None


def variants(
    body: Polyhedron, grasp: Grasp, friction: float, asked: Learning, seed: int
) -> Iterator[Variant]:
    """Yield grasps with other frictions and contacts, as far as they exist and can be decided."""
    at = Seated(body, grasp.faces, grasp.contacts)
    for kind in ("friction_below", "friction_near", "friction_above"):
        for number in range(getattr(asked, kind)):
            ratio = _ratio(kind, draws_by_name(seed, grasp.id, kind, number))
            varied = _short(ratio * grasp.critical_friction)
            if LEAST_CONTROL_FRICTION <= varied <= LARGEST_FRICTION:
                yield from _decided(kind, number, at, varied, UNMOVED)
    for number in range(asked.moved_out):
        yield from _moved(
            body, grasp, friction, number, draws_by_name(seed, grasp.id, "moved_out", number)
        )


def region_exit(region: ContactRegion, contact: Contact, way: Array) -> float:
    """Return how far a region reaches from its contact along a unit vector in its plane [m]."""
    if len(region.polygon) < 3:  # noqa: PLR2004 - a point or a line has no inside
        return 0.0
    frame = plane_frame(contact.normal)
    outward, ends = edge_rows(convex_hull((region.polygon - contact.position) @ frame))
    speeds = outward @ (way @ frame)
    reached = ends[speeds > 0.0] / speeds[speeds > 0.0]
    return max(0.0, float(reached.min(initial=math.inf)))


def _moved(
    body: Polyhedron, grasp: Grasp, friction: float, number: int, rng: np.random.Generator
) -> Iterator[Variant]:
    """Yield the grasp with one to four contacts out of their regions, if they stay on faces."""
    chosen = rng.permutation(FINGERS)[: int(rng.integers(1, FINGERS + 1))]
    contacts = list(grasp.contacts)
    exits: list[float | None] = [None] * FINGERS
    for finger in chosen.tolist():
        found = _past(body, grasp, finger, rng)
        if found is not None:
            contacts[finger], exits[finger] = found
    if all(each is None for each in exits):
        return
    try:
        at = Seated(body, grasp.faces, four(contacts))
        if body.patches is not None:  # the surface departs from the plane of its patch
            points = [contact.position for contact in contacts]
            at = seat(body, points, [contact.normal for contact in contacts])
    except InputError:
        return
    moved = np.array([contact.position for contact in at.contacts]) - grasp.positions
    cells = {"displaced_m": np.linalg.norm(moved, axis=1), "region_exit_m": exits}
    yield from _decided("moved_out", number, at, friction, cells)


def _past(
    body: Polyhedron, grasp: Grasp, finger: int, rng: np.random.Generator
) -> tuple[Contact, float] | None:
    """Move a contact past its region's end on its face; return how far the region reached, too."""
    contact, face = grasp.contacts[finger], body.faces[grasp.faces[finger]]
    frame = plane_frame(contact.normal)
    for _ in range(MOVE_TRIES):
        turn = rng.uniform(0.0, 2.0 * math.pi)
        way = frame @ np.array([math.cos(turn), math.sin(turn)])
        reached = region_exit(grasp.regions[finger], contact, way)
        more = rng.uniform(*PAST) * max(reached, LEAST_WAY * body.radius)
        point = contact.position + (reached + more) * way
        if any(within(point, piece, face.normal, 0.0) for piece in face.pieces):
            return Contact(point, contact.normal), reached
    return None


def _decided(
    kind: str, number: int, at: Seated, friction: float, moved: RowCells
) -> Iterator[Variant]:
    name = f"{kind}-{number}"
    try:
        proved = grasp_of(at, friction, name)
        critical = critical_friction(list(at.contacts))
    except (UndecidedError, SolverError):
        return
    known = {"critical_friction": critical if math.isfinite(critical) else None}
    cells = {"kind": kind, **moved, **({} if isinstance(proved, Grasp) else known)}
    yield Variant(name, at, friction, proved, cells)


def heavier(
    body: Polyhedron, grasp: Grasp, friction: float, executed: Executed, asked: Learning, seed: int
) -> Iterator[Variant]:
    """Yield the grasp with masses near the one at which it is predicted to be lost."""
    if not isinstance(executed, ExecutedGrasp) or executed.execution is None:
        return
    lost_kg, kind = executed.least_predicted_loss * executed.execution.mass_kg, "mass_near"
    at = Seated(body, grasp.faces, grasp.contacts)
    for number in range(asked.mass_near):
        mass_kg = _short(_ratio(kind, draws_by_name(seed, grasp.id, kind, number)) * lost_kg)
        if 0.0 < mass_kg < math.inf:
            cells = {"kind": kind, **UNMOVED, "mass_ratio": mass_kg / lost_kg}
            yield Variant(f"{kind}-{number}", at, friction, grasp, cells, mass_kg)


def _ratio(kind: str, rng: np.random.Generator) -> float:
    least, most = VARIED_RATIOS[kind]
    return math.exp(rng.uniform(math.log(least), math.log(most)))


def _short(value: float) -> float:
    return float(f"{value:.{VARIED_DIGITS - 1}e}")


def validated_with(
    body: Polyhedron, grasp: Grasp, friction: float, agenda: Agenda, most: int
) -> Verdict:
    """Test a grasp in simulation, with no more than some synthetic negative controls."""
    verdict = validate(body, grasp, friction, agenda=replace(agenda, controls=False))
    found = negative_controls(body, grasp, friction, agenda.seed)
    order = draws_by_name(agenda.seed, grasp.id, "synthetic", 0).permutation(len(found))
    kept = (found[int(place)] for place in np.sort(order[:most]))
    controls = tuple(try_control(body, each, agenda, Setup()) for each in kept)
    return replace(verdict, controls=controls, agenda=agenda)
