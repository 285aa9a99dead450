"""Checks the rows of a dataset against each other and against what is proved of them again.

A row is checked against its contacts and trials, and the grasp that it was made from. The multiple
of the weight that a squeeze carries follows from contacts, squeeze, mass and springs alone, so it
is proved again for every row; what a trial did is only simulated again in a sample. A pose of a
hand is not searched for again: it counts if joints are within their ranges, fingertips touch the
object at the stated contacts, the hand overlaps neither the object nor itself, and the contacts are
proved to be in force closure at the row's friction.
"""

from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cached_property
from itertools import chain
from typing import Any

import numpy as np

from grasp_core.arrays import Array
from grasp_core.closure.critical_friction import critical_friction
from grasp_core.closure.force_closure import force_closure
from grasp_core.errors import GraspError, InputError, UndecidedError
from grasp_core.execution.grips import grip
from grasp_core.execution.loads import any_direction
from grasp_core.execution.squeeze_certificate import Survival
from grasp_core.frames import POSE_SIZE
from grasp_core.hands.collisions import clearances, tip_distances
from grasp_core.hands.hand import Hand
from grasp_core.objects.on_faces import SolidSurface
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import FINGERS
from sim_validate.datasets.columns import (
    FROM_TOOL,
    ROUNDOFF,
    VARIED,
    DatasetRows,
    GraspRow,
    ObjectRow,
)
from sim_validate.datasets.config import KEYS, REFERENCES, TABLE_NAMES, TableName
from sim_validate.datasets.layout import CONFIG
from sim_validate.datasets.learning import (
    VARIED_RATIOS,
    contact_cells,
    hand_named,
    ratio_of,
    trial_cells,
)
from sim_validate.datasets.making_rows import PLANNED_KIND
from sim_validate.datasets.open_dataset import Dataset
from sim_validate.datasets.parquet import agrees
from sim_validate.engine.held_or_let_go import Outcome
from sim_validate.execution.holders import tip_radius
from sim_validate.execution.verdict import ExecutionTrial

ON_MESH, NEAR_MESH = 1e-5, 0.05
"""Largest distance of contacts from the mesh, for grasps and negative controls, relative to the
object's radius. Planar faces are as flat as six digits show. Negative controls are moved in
the planes of patches, from which a curved surface departs."""
RATIO_TOLERANCE = 1e-3
"""Share by which a ratio may leave its band: frictions and masses are rounded to four digits."""
NAMING_COLUMNS: Mapping[tuple[TableName, str], tuple[TableName, str]] = {
    **REFERENCES, ("grasps", "control_of"): ("grasps", "grasp_id"),
}  # fmt: skip
LABELS = {"grasp": PLANNED_KIND, FROM_TOOL: FROM_TOOL}
"""Kind of the rows of a label; other labels but `varied` are kinds themselves."""
UNBALANCED = 1e-9
"""Wrench that balanced forces leave, relative to the forces, at object radius one."""
TOUCHES_M = 2e-5
"""Largest distance of a fingertip from its contact [m]: twice what the search allows."""
APART_M = 4e-4
"""Least distance of the hand's links from each other [m]; the search keeps 0.5 mm."""
POSE_ROUNDING = 1e-9
"""How far rounding may move an angle beyond its range [rad], a link into the object [m], a pose
from a rigid motion, or a direction from unit length."""


class RowChecks:
    """Checks of the rows of one object in all tables, by what follows from their cells."""

    def __init__(self, part: Dataset, rows: DatasetRows) -> None:
        self.part, self.config, self.rows = part, part.config, rows
        self.by_name = {row.grasp_id: row for row in rows.grasps}
        self.outcomes = defaultdict[str, list[Outcome]](list)
        self.executions = defaultdict[str, list[ExecutionTrial]](list)
        for row in rows.trials:
            self.outcomes[row.grasp_id].append(row.hold.outcome)
        for row in rows.executions:
            self.executions[row.grasp_id].append(row.tried)

    @cached_property
    def bodies(self) -> Mapping[str, Polyhedron]:
        """The object, or the objects whose names begin alike."""
        rows = self.rows.objects
        return {row.object_id: self.part.body(row.object_id, row.source_name) for row in rows}

    def faults(self) -> Iterator[str]:
        """Yield sentences on what is wrong with the rows of all tables."""
        yield from self._table_faults()
        for row in self.rows.objects:
            yield from self._mesh_faults(row)
        for row in self.rows.grasps:
            own = chain(self._row_faults(row), self._requested_faults(row))
            yield from (f"grasps: {row.grasp_id}: {fault}" for fault in own)

    def _table_faults(self) -> Iterator[str]:
        split = self.part.split
        if any(row.split != split for row in (*self.rows.objects, *self.rows.grasps)):
            yield f"objects or grasps: files of the split {split} have rows of another split"
        for name in TABLE_NAMES:
            rows = self.rows.of(name)
            keys = Counter(tuple(getattr(row, key) for key in KEYS[name]) for row in rows)
            if any(count > 1 for count in keys.values()):
                yield f"{name}: two rows have the same {' and '.join(KEYS[name])}"
        for (name, column), (other, key) in NAMING_COLUMNS.items():
            there = {getattr(row, key) for row in self.rows.of(other)}
            named = {getattr(row, column) for row in self.rows.of(name)} - {None}
            yield from (
                f"{name}: {missing}, named in {column}, has no row in the table of {other}"
                for missing in sorted(named - there)
            )

    def _mesh_faults(self, row: ObjectRow) -> Iterator[str]:
        try:
            mesh = self.part.surface(row.object_id)
        except InputError as error:
            yield str(error)
            return
        surface = SolidSurface(mesh.vertices, mesh.triangles)
        own = (each for each in self.rows.grasps if each.object_id == row.object_id)
        on_it = [on for each in own if each.was_tried
                 for on in _on_surface(surface, each, row.radius_m)]  # fmt: skip
        if off := on_it.count(False):
            yield (
                f"grasps: {off} contacts of {row.source_name} are not on the object, or not "
                "with its normals"
            )

    def _row_faults(self, row: GraspRow) -> Iterator[str]:
        outcomes = self.outcomes[row.grasp_id]
        held = all(one is Outcome.HELD for one in outcomes) if row.was_tried else None
        by_trials = {"trials": len(outcomes), "held": held}
        yield from disagreements(row, by_trials, "the table of trials")
        own = row.control_of is None and row.label != VARIED
        if own and row.friction not in self.config.frictions:
            yield f"friction {row.friction} is not among those of {CONFIG}"
        if row.was_tried:
            yield from _contact_faults(row)

    def _requested_faults(self, row: GraspRow) -> Iterator[str]:
        """Check what a dataset has only on request, of a row whose object is there."""
        executed, learned = self.config.execution is not None, self.config.learning is not None
        body = self.bodies.get(row.object_id) if executed or learned else None
        if body is None:
            return
        if executed:
            found = [*self._execution_faults(row)]
            yield from found or self._squeeze_faults(row, body)
        if learned:
            yield from self._learning_faults(row, body)

    def _learning_faults(self, row: GraspRow, body: Polyhedron) -> Iterator[str]:
        if row.label == VARIED:
            yield from self._variant_faults(row, body)
        else:
            yield from disagreements(row, {"kind": LABELS.get(row.label, row.label)}, "label")
        ratio = {"friction_ratio": ratio_of(row.friction, row.critical_friction)}
        yield from disagreements(row, ratio, "the critical friction")
        if row.was_tried:
            by_contacts = contact_cells(self.config, body, row.placed)
            yield from disagreements(row, by_contacts, "the contacts")
        if row.witness_forces_n is not None:
            yield from _witness_faults(row, row.witness_forces_n, body)
        if self.config.asked.hand:
            yield from _hand_faults(row, hand_named(self.config.asked.hand), body)

    def _variant_faults(self, row: GraspRow, body: Polyhedron) -> Iterator[str]:
        source = self.by_name.get(row.made_from or "")
        if source is None:
            yield f"{row.made_from}, named in made_from, has no row"
            return
        stated, exits = row.displaced_m, row.region_exit_m
        if stated is None or exits is None or len(row.points) != len(source.points):
            yield "displaced_m or region_exit_m is missing, or contacts of made_from are"
            return
        moves = np.linalg.norm(row.points - source.points, axis=1)
        yield from disagreements(row, {"displaced_m": moves}, "the contacts of made_from")
        if (row.kind == "moved_out") == (not stated.any()):
            yield f"contacts of the kind {row.kind} are not where they must be"
        # where a contact did not move, its exit is NaN, which nothing is below
        if body.patches is None and (stated <= exits * (1.0 - ROUNDOFF)).any():
            yield "a contact was moved, but is still in its region"
        try:
            critical = critical_friction(row.points, row.normals)
        except GraspError as error:
            yield f"the critical friction cannot be computed ({error})"
            return
        yield from disagreements(row, {"critical_friction": critical}, "the contacts")
        if row.kind in VARIED_RATIOS:
            least, most = VARIED_RATIOS[row.kind]
            ratio = row.mass_ratio if row.kind == "mass_near" else row.friction_ratio
            if ratio is None or not least * (1.0 - RATIO_TOLERANCE) <= ratio <= most * (
                1.0 + RATIO_TOLERANCE
            ):
                yield f"the ratio {ratio} is none of the kind {row.kind}"

    def _execution_faults(self, row: GraspRow) -> Iterator[str]:
        trials = self.executions[row.grasp_id]
        if not row.executed:
            if trials:
                yield "the table of executions has trials of it, although none was simulated"
            return
        wanted = trial_cells(trials)
        if self.config.learning is None:
            del wanted["predicted_loss"]
        else:
            carried = (row.load_multiple or 0.0) * (row.mass_kg or 0.0)
            yield from disagreements(row, {"payload_kg": carried}, "load_multiple times the mass")
        yield from disagreements(row, wanted, "the table of executions")

    def _squeeze_faults(self, row: GraspRow, body: Polyhedron) -> Iterator[str]:
        yield from self._load_faults(row, body, "load_multiple")
        if row.least_squeeze_n is not None:
            # it carries the weight itself, with no larger push
            least = replace(row, squeeze_n=row.least_squeeze_n, load_multiple=1.0)
            yield from self._load_faults(least, body, "least_push_n", row.least_push_n)

    def _load_faults(
        self, row: GraspRow, body: Polyhedron, claim: str, push_n: float | None = None
    ) -> Iterator[str]:
        asked, load, mass_kg = self.config.execution, row.load_multiple, row.mass_kg
        if asked is None or row.squeeze_n is None or load is None or mass_kg is None:
            return  # nothing was executed
        try:
            settings = asked.for_body(body)
            if row.mass_ratio is not None:
                settings = replace(settings, mass_kg=mass_kg)
            held = grip(
                row.held_on(body), row.placed, row.friction, row.squeeze_n[: row.contacts],
                stiffness=settings.tip_stiffness_n_per_m,
                tip_radius_m=tip_radius(row.held_on(body), row.placed, settings),
            )  # fmt: skip
        except GraspError as error:
            yield f"the contacts cannot be squeezed as the row says ({error})"
            return
        if faults := list(disagreements(row, {"mass_kg": settings.object_kg}, CONFIG)):
            yield from faults
            return
        survival = Survival.of(held, any_direction(settings.object_kg))
        reactions = survival.reactions(held.local_squeeze)
        multiple = load * (1.0 - ROUNDOFF)
        pushes = reactions.start[:, 0] + multiple * reactions.swing
        most_n = settings.push_n if push_n is None else push_n
        limited = bool((pushes <= most_n * (1.0 + ROUNDOFF)).all())
        if not (limited and reactions.survives(multiple, reactions.multipliers(multiple))):
            stated = getattr(row, claim)
            yield f"{claim} is {stated:.9g}, but the squeeze is not proved to carry as much"


def _on_surface(surface: SolidSurface, row: GraspRow, radius_m: float) -> Iterator[bool]:
    """Yield for each contact whether it is on the object, with its normal if it is no control's."""
    for point, normal in zip(row.points, row.normals, strict=True):
        if row.control_of is None:
            yield surface.holds(point, normal, ON_MESH * radius_m)
        else:
            yield surface.holds(point, None, NEAR_MESH * radius_m)


def _contact_faults(row: GraspRow) -> Iterator[str]:
    try:
        found = force_closure(row.points, row.normals, row.friction)
    except UndecidedError as error:
        if row.force_closed:
            yield f"force closure of the contacts cannot be decided ({error})"
        return
    except GraspError as error:
        yield f"force closure of the contacts cannot be computed ({error})"
        return
    margin = {"closure_margin": found.margin} if found.closed and row.force_closed else {}
    yield from disagreements(row, {"force_closed": found.closed, **margin}, "the contacts")


def _witness_faults(row: GraspRow, forces: Array, body: Polyhedron) -> Iterator[str]:
    arms = (row.points - body.center_of_mass) / body.radius
    pushes = np.einsum("ki,ki->k", forces, row.normals)
    across = np.linalg.norm(forces - pushes[:, None] * row.normals, axis=1)
    left = np.concatenate([forces.sum(axis=0), np.cross(arms, forces).sum(axis=0)])
    in_cones = (across <= row.friction * pushes * (1.0 + ROUNDOFF) + UNBALANCED).all()
    if not in_cones or np.abs(left).max() > ROUNDOFF or abs(pushes.sum() - 1.0) > ROUNDOFF:
        yield "witness_forces_n are no balanced forces in the friction cones"


def _hand_faults(row: GraspRow, hand: Hand, body: Polyhedron) -> Iterator[str]:
    if bool(row.force_closed) != (row.hand_reached is not None):
        yield f"hand_reached is {row.hand_reached}, but force_closed is {row.force_closed}"
    joints, pose, fingers = row.hand_joints_rad, row.T_object_palm_m, row.hand_fingers
    points, normals = row.hand_points_m, row.hand_normals
    if joints is None or pose is None or fingers is None or points is None or normals is None:
        return  # the hand does not reach the grasp
    standing: list[int] = fingers.tolist()
    if len({*standing}) < FINGERS or fingers.max() >= len(hand.fingers):
        yield f"hand_fingers are {standing}, not {FINGERS} of the hand's {len(hand.fingers)}"
        return
    surface, turn = SolidSurface(body.vertices, body.triangles), pose[:3, :3]
    roundings = np.array([hand.fingers[finger].tip.core[1] for finger in standing])
    behind = points - roundings[:, None] * normals  # within the tips, as deep as they are rounded
    gaps = tip_distances(hand, joints, pose, standing, behind) + roundings
    found, way = clearances(hand, body, joints, pose, fingers), row.hand_approach
    rules = {
        "hand_joints_rad are not within the ranges of the joints": _in_ranges(joints, hand),
        "hand_open_joints_rad are not within the ranges of the joints": (
            row.hand_open_joints_rad is None or _in_ranges(row.hand_open_joints_rad, hand)
        ),
        "T_object_palm_m is not a rigid motion": (
            np.abs(turn @ turn.T - np.eye(3)).max() <= POSE_ROUNDING and np.linalg.det(turn) > 0.0
            and pose[3].tolist() == np.eye(POSE_SIZE)[3].tolist()
        ),
        "hand_approach is not of unit length": (
            way is None or abs(np.linalg.norm(way) - 1.0) <= POSE_ROUNDING
        ),
        "hand_points_m are not on the object, or hand_normals not its normals there": all(
            surface.holds(point, normal, TOUCHES_M)
            for point, normal in zip(points, normals, strict=True)
        ),
        "the fingertips of hand_joints_rad do not touch the object at hand_points_m": (
            gaps.max() <= TOUCHES_M
        ),
        # a link whose tip touches the object may come as near to it as it likes
        "the hand of hand_joints_rad overlaps the object or itself": (
            found.itself >= APART_M and found.object >= -POSE_ROUNDING and found.tips >= -TOUCHES_M
        ),
        "hand_points_m are not proved to be in force closure": (
            _is_proved(points, normals, row.friction)
        ),
    }  # fmt: skip
    yield from (fault for fault, fits in rules.items() if not fits)


def _in_ranges(angles: Array, hand: Hand) -> bool:
    low, high = hand.ranges.T
    return bool(((angles >= low - POSE_ROUNDING) & (angles <= high + POSE_ROUNDING)).all())


def _is_proved(points: Array, normals: Array, friction: float) -> bool:
    try:
        certificate = force_closure(points, normals, friction)
        return certificate.closed and certificate.verify()
    except GraspError:
        return False


def disagreements(row: GraspRow, wanted: Mapping[str, Any], source: str) -> Iterator[str]:
    """Yield cells of a row that something else says otherwise, beyond what their kinds allow."""
    for name, value in wanted.items():
        stated = getattr(row, name)
        if not agrees(GraspRow, name, stated, value):
            yield f"{name} is {stated}, but {value} by {source}"
