"""Checks rows of one object: against their contacts and trials, and the grasps they were made from.

The multiple of the weight that a squeeze carries follows from contacts, squeeze, mass and springs
alone, so it is proved again for every row; what a trial did is only simulated again in a sample. A
pose of a hand is not searched for again: it counts if joints are within their ranges, fingertips
touch the object at the stated contacts, the hand overlaps neither the object nor itself, and the
contacts are proved to be in force closure at the row's friction.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from grasp_core.arrays import Array
from grasp_core.closure.critical_friction import critical_friction
from grasp_core.closure.force_closure import force_closure
from grasp_core.errors import GraspError, InputError, UndecidedError
from grasp_core.execution.grips import grip
from grasp_core.execution.loads import any_direction
from grasp_core.execution.squeeze_rows import Survival
from grasp_core.frames import POSE
from grasp_core.geometry.nearest_points import Surface
from grasp_core.hands.collisions import clearances, tip_distances
from grasp_core.hands.hand import Hand
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.planning.given_contacts import seat
from grasp_core.values import FINGERS, Contact
from sim_validate.datasets.build import CONFIG
from sim_validate.datasets.config import DatasetConfig
from sim_validate.datasets.figures import Figures, hand_named
from sim_validate.datasets.meshes import stored_body, stored_surface
from sim_validate.datasets.open_dataset import ObjectRows, Row
from sim_validate.datasets.rows import GIVEN, NOT_TRIED, PLANNED
from sim_validate.datasets.tables import KEYS
from sim_validate.datasets.varied import RATIOS, VARIED
from sim_validate.execution.execute import tip_radius
from sim_validate.execution.settings import ExecutionSettings

SAME_MARGIN = 1e-6
"""Largest difference between a closure margin in a row and that of the contacts, relative to the
friction."""
ON_SURFACE, NEAR_SURFACE = 1e-5, 0.05
"""Largest distance of contacts from the mesh, for grasps and negative controls, relative to the
object's radius. Planar faces are as flat as six digits show. Negative controls are moved in
the planes of patches, from which a curved surface departs."""
UNIT = 1e-9
"""Largest difference between a normal's length and one."""
ROUNDING = 1e-6
"""Share of any number that processors may round differently."""
NEAR_ZERO = 1e-7
"""Difference of critical frictions that counts as none: those near zero are found to millionths."""
BAND = 1e-3
"""Share by which a ratio may leave its band: frictions and masses are rounded to four digits."""
LABELS = {"grasp": PLANNED, GIVEN: GIVEN}
"""Kind of the rows of a label; other labels but `varied` are kinds themselves."""
CLAIMS = (
    "survived", "mass_kg", "squeeze_n", "load_multiple", "predicted_first_slip",
    "simulated_first_slip", "executed_trials", "execution_mismatches",
)  # fmt: skip
OFF = 1e-9
"""Wrench that balanced forces leave, relative to the forces, at object radius one."""
TOUCHES_M = 2e-5
"""Largest distance of a fingertip from its contact [m]: twice what the search allows."""
APART_M = 4e-4
"""Least distance of the hand's links from each other [m]; the search keeps 0.5 mm."""
ROUNDED = 1e-9
"""How far rounding may move an angle beyond its range [rad], a link into the object [m], a pose
from a rigid motion, or a direction from unit length."""


def object_faults(
    folder: Path, config: DatasetConfig, split: str, rows: ObjectRows
) -> Iterator[str]:
    """Yield sentences on what is wrong with the rows of one object, and with its mesh."""
    yield from _table_faults(split, rows)
    yield from _row_faults(rows, config.frictions)
    yield from _mesh_faults(folder, rows)
    if config.execution is not None or config.learning is not None:
        yield from _requested_faults(folder, config, rows)


def _table_faults(split: str, rows: ObjectRows) -> Iterator[str]:
    for name in ("objects", "grasps"):
        if any(row["split"] != split for row in rows[name]):
            yield f"{name}: files of the split {split} have rows of another split"
    for name in rows:
        keys = [tuple(row[key] for key in KEYS[name]) for row in rows[name]]
        if len(set(keys)) < len(keys):
            yield f"{name}: two rows have the same {' and '.join(KEYS[name])}"


def _row_faults(rows: ObjectRows, frictions: Sequence[float]) -> Iterator[str]:
    splits = {row["object_id"]: row["split"] for row in rows["objects"]}
    names = {row["grasp_id"] for row in rows["grasps"]}
    ended: dict[str, list[str]] = {}
    for trial in rows["trials"]:
        ended.setdefault(trial["grasp_id"], []).append(trial["outcome"])
    yield from (
        f"trials: {name} has no row in the table of grasps" for name in sorted(ended.keys() - names)
    )
    for row in rows["grasps"]:
        name = row["grasp_id"]
        faults = list[str]()
        if splits.get(row["object_id"]) != row["split"]:
            faults.append("the row's object is missing, or in another split")
        if row["control_of"] is not None and row["control_of"] not in names:
            faults.append(f"{row['control_of']}, named in control_of, has no row")
        faults += _outcome_faults(row, ended.get(name, []))
        own = row["control_of"] is None and row["label"] != VARIED
        if own and row["friction"] not in frictions:
            faults.append(f"friction {row['friction']} is not among those of {CONFIG}")
        if row["outcome"] != NOT_TRIED:
            faults += _contact_faults(row)
        yield from (f"grasps: {name}: {fault}" for fault in faults)


def _outcome_faults(row: Mapping[str, Any], trials: Sequence[str]) -> Iterator[str]:
    """Check that a row agrees with its trials, and claims nothing if it was not tried."""
    if row["outcome"] == NOT_TRIED:
        claims = [row[name] for name in ("held", "force_closed", "closure_margin")]
        if row["label"] != GIVEN or any(claim is not None for claim in claims) or trials:
            yield "the row claims results, although the grasp was not tried"
        return
    held = all(one == "held" for one in trials)
    if not trials or len(trials) != row["trials"] or row["held"] != held:
        yield "the row contradicts the table of trials"
    elif (row["outcome"] == "held") != held:
        yield f"`outcome` is {row['outcome']!r}, but `held` is {held}"


def _mesh_faults(folder: Path, rows: ObjectRows) -> Iterator[str]:
    claimed: dict[str, list[tuple[Array, Array | None, float]]] = {
        row["object_id"]: [] for row in rows["objects"]
    }
    for row in rows["grasps"]:
        of_object = claimed.get(row["object_id"])
        if row["outcome"] == NOT_TRIED or of_object is None:
            continue
        points, normals = row["contact_points_m"], row["contact_normals"]
        for point, normal in list(zip(points, normals, strict=True))[: row["contacts"]]:
            if row["control_of"] is None:
                of_object.append((np.array(point), np.array(normal), ON_SURFACE))
            else:  # some controls have a flipped normal
                of_object.append((np.array(point), None, NEAR_SURFACE))
    for row in rows["objects"]:
        try:
            mesh = stored_surface(folder, row["object_id"])
        except InputError as error:
            yield str(error)
            continue
        surface = Surface(mesh.vertices, mesh.triangles)
        on_it = [
            surface.holds(point, normal, slack * row["radius_m"])
            for point, normal, slack in claimed[row["object_id"]]
        ]
        if off := on_it.count(False):
            yield (
                f"grasps: {off} contacts of {row['source_name']} are not on the object, or not "
                "with its normals"
            )


def _contact_faults(row: Mapping[str, Any]) -> Iterator[str]:
    """Check the normals of a contact set, and compute its closure from the contacts alone."""
    count = row["contacts"]
    closed = row["force_closed"]
    if not 1 <= count <= FINGERS or closed is None or (closed and row["closure_margin"] is None):
        yield "the row lacks its contacts, or results about them"
        return
    points = np.array(row["contact_points_m"][:count], dtype=np.float64)
    normals = np.array(row["contact_normals"][:count], dtype=np.float64)
    if not (np.abs(np.linalg.norm(normals, axis=1) - 1.0) <= UNIT).all():
        yield "a contact normal is not a unit vector"
        return
    try:
        certificate = force_closure(points, normals, row["friction"])
    except UndecidedError as error:
        if row["force_closed"]:
            yield f"force closure of the contacts cannot be decided ({error})"
        return
    except GraspError as error:
        yield f"force closure of the contacts cannot be computed ({error})"
        return
    if certificate.closed != row["force_closed"]:
        yield (
            f"force_closed is {row['force_closed']}, but from the contacts it is "
            f"{certificate.closed}"
        )
    elif certificate.closed and not np.isclose(
        certificate.margin, row["closure_margin"], rtol=0.0, atol=SAME_MARGIN * row["friction"]
    ):
        stated = row["closure_margin"]
        yield (
            f"closure margin is {stated:.9g}, but from the contacts it is {certificate.margin:.9g}"
        )


def _requested_faults(folder: Path, config: DatasetConfig, rows: ObjectRows) -> Iterator[str]:
    trials: dict[str, list[Row]] = {}
    for trial in rows.get("executions", ()):
        trials.setdefault(trial["grasp_id"], []).append(trial)
    by_name = {row["grasp_id"]: row for row in rows["grasps"]}
    yield from (
        f"executions: {name} has no row in the table of grasps"
        for name in sorted(trials.keys() - by_name.keys())
    )
    for of_object in rows["objects"]:
        name = of_object["object_id"]
        body = stored_body(folder, name, of_object["source_name"], config.faces)
        for row in rows["grasps"]:
            if row["object_id"] != name:
                continue
            found, own = list[str](), trials.get(row["grasp_id"], [])
            if config.execution is not None:
                found += _trial_faults(row, own)
                if row["executed"] and not found:
                    found += _squeeze_faults(row, body, config.execution)
            if config.learning is not None:
                if row["label"] == VARIED:
                    found += _varied_faults(row, by_name, is_curved=bool(of_object["curved"]))
                elif row["kind"] != (wanted := LABELS.get(row["label"], row["label"])):
                    found.append(f"kind is {row['kind']}, but {wanted} by label")
                figures = Figures(config.learning, config.execution)
                found += _closure_faults(row, body, figures)
                found += _margin_faults(row, own)
                if config.learning.hand:
                    found += _hand_faults(row, hand_named(config.learning.hand), body)
            yield from (f"grasps: {row['grasp_id']}: {fault}" for fault in found)


def _varied_faults(row: Row, by_name: Mapping[str, Row], *, is_curved: bool) -> Iterator[str]:
    source = by_name.get(row["made_from"])
    if source is None:
        yield f"{row['made_from']}, named in made_from, has no row"
        return
    moves = np.subtract(row["contact_points_m"], source["contact_points_m"])
    stated = np.array(row["displaced_m"])
    size = max(1.0, float(np.abs(stated).max()))
    if not np.allclose(np.linalg.norm(moves, axis=1), stated, rtol=0.0, atol=ROUNDING * size):
        yield "displaced_m is not the distance from the contacts of made_from"
    if (row["kind"] == "moved_out") == (not stated.any()):
        yield f"contacts of the kind {row['kind']} are not where they must be"
    if not is_curved and any(
        exit_m is not None and moved <= exit_m * (1.0 - ROUNDING)
        for moved, exit_m in zip(stated, row["region_exit_m"], strict=True)
    ):
        yield "a contact was moved, but is still in its region"
    yield from _ratio_faults(row)


def _ratio_faults(row: Row) -> Iterator[str]:
    try:
        critical = critical_friction(row["contact_points_m"], row["contact_normals"])
    except GraspError as error:
        yield f"the critical friction cannot be computed ({error})"
        return
    wanted = row["friction"] / critical if 0.0 < critical < np.inf else None
    known = row["friction_ratio"]
    if (known is None) != (wanted is None) or (
        wanted is not None
        and not np.isclose(row["friction"] / known, critical, rtol=10.0 * ROUNDING, atol=NEAR_ZERO)
    ):
        yield f"friction_ratio is {known}, but from the contacts it is {wanted}"
    if row["kind"] in RATIOS:
        least, most = RATIOS[row["kind"]]
        ratio = row["mass_ratio"] if row["kind"] == "mass_near" else known
        if ratio is None or not least * (1.0 - BAND) <= ratio <= most * (1.0 + BAND):
            yield f"the ratio {ratio} is none of the kind {row['kind']}"


def _trial_faults(row: Row, trials: Sequence[Row]) -> Iterator[str]:
    """Check that a row agrees with its trials, and claims nothing if it was not executed."""
    if row["control_of"] is not None or not row["executed"]:
        claimed = [name for name in CLAIMS if row[name] is not None]
        unheld = claimed == ["survived"] and not row["survived"] and row["execution_note"]
        if row["executed"] or trials or (claimed and not unheld):
            yield "the row claims results of an execution, although none was simulated"
        return
    first_slips = [
        [trial[name] for trial in trials if trial[name] is not None]
        for name in ("predicted_first_slip", "simulated_first_slip")
    ]
    wanted = {
        "executed_trials": len(trials),
        "survived": all(trial["survived"] for trial in trials) if trials else None,
        "predicted_first_slip": min(first_slips[0], default=None),
        "simulated_first_slip": min(first_slips[1], default=None),
    }
    yield from (
        f"{name} is {row[name]}, but {value} by the table of executions"
        for name, value in wanted.items()
        if row[name] != value
    )


def _squeeze_faults(row: Row, body: Polyhedron, asked: ExecutionSettings) -> Iterator[str]:
    """Check the mass, and prove again that the squeeze carries what the row says."""
    yield from _proved(row, body, asked, "squeeze_n", "load_multiple")
    if row.get("least_squeeze_n") is not None:
        # it carries the weight itself, with no larger push
        least = {**row, "squeeze_n": row["least_squeeze_n"], "load_multiple": 1.0}
        yield from _proved(least, body, asked, "least_squeeze_n", "least_push_n")


def _proved(
    row: Row, body: Polyhedron, asked: ExecutionSettings, squeeze: str, claim: str
) -> Iterator[str]:
    """Check that a squeeze carries a multiple of the weight, with pushes that are allowed."""
    count = row["contacts"]
    try:
        settings = asked.for_body(body)
        if row.get("mass_ratio") is not None:
            settings = replace(settings, mass_kg=row["mass_kg"])
        points, normals = row["contact_points_m"][:count], row["contact_normals"][:count]
        contacts = list(map(Contact, points, normals))
        if row["label"] in (GIVEN, VARIED):  # on curved surfaces they have faces of their own
            body = seat(body, points, normals).body
        held = grip(
            body, contacts, row["friction"], row["squeeze_n"][:count],
            stiffness=settings.tip_stiffness_n_per_m,
            tip_radius_m=tip_radius(body, contacts, settings),
        )  # fmt: skip
    except GraspError as error:
        yield f"the contacts cannot be squeezed as the row says ({error})"
        return
    if not np.isclose(row["mass_kg"], settings.object_kg, rtol=ROUNDING, atol=0.0):
        yield f"mass_kg is {row['mass_kg']:.9g}, but by {CONFIG} it is {settings.object_kg:.9g}"
        return
    survival = Survival.of(held, any_direction(settings.object_kg))
    reactions = survival.reactions(held.local_squeeze)
    multiple = row["load_multiple"] * (1.0 - ROUNDING)
    pushes = reactions.start[:, 0] + multiple * reactions.swing
    push_n = row["least_push_n"] if claim == "least_push_n" else settings.push_n
    limited = bool((pushes <= push_n * (1.0 + ROUNDING)).all())
    if not (limited and reactions.survives(multiple, reactions.multipliers(multiple))):
        yield (
            f"{claim} is {row[claim]:.9g}, but the squeeze is not proved to carry as much "
            f"({squeeze})"
        )


def _closure_faults(row: Row, body: Polyhedron, figures: Figures) -> Iterator[str]:
    if "span_angle_rad" not in row or row["force_closed"] is None:
        return
    count = row["contacts"]
    contacts = [*map(Contact, row["contact_points_m"][:count], row["contact_normals"][:count])]
    for name, value in figures.of_contacts(body, contacts).items():
        stated = row[name]
        if (stated is None) != (value is None) or (
            value is not None and not np.isclose(stated, value, rtol=ROUNDING, atol=ROUNDING)
        ):
            yield f"{name} is {stated}, but from the contacts it is {value}"
    if row["witness_forces_n"] is not None:
        yield from _witness_faults(row, body)


def _witness_faults(row: Row, body: Polyhedron) -> Iterator[str]:
    forces, normals = np.array(row["witness_forces_n"]), np.array(row["contact_normals"])
    arms = (np.array(row["contact_points_m"]) - body.center_of_mass) / body.radius
    pushes = np.einsum("ki,ki->k", forces, normals)
    across = np.linalg.norm(forces - pushes[:, None] * normals, axis=1)
    left = np.concatenate([forces.sum(axis=0), np.cross(arms, forces).sum(axis=0)])
    in_cones = (across <= row["friction"] * pushes * (1.0 + ROUNDING) + OFF).all()
    if not in_cones or np.abs(left).max() > ROUNDING or abs(pushes.sum() - 1.0) > ROUNDING:
        yield "witness_forces_n are no balanced forces in the friction cones"


def _margin_faults(row: Row, trials: Sequence[Row]) -> Iterator[str]:
    if not row.get("executed") or "payload_kg" not in row:
        return
    carried = row["load_multiple"] * row["mass_kg"]
    if not np.isclose(row["payload_kg"], carried, rtol=ROUNDING, atol=0.0):
        yield f"payload_kg is {row['payload_kg']}, but load_multiple times the mass is {carried}"
    losses = [trial["predicted_loss"] for trial in trials if trial["predicted_loss"] is not None]
    if row["predicted_loss"] != min(losses, default=None):
        yield f"predicted_loss is {row['predicted_loss']}, but not by the table of executions"


def _hand_faults(row: Row, hand: Hand, body: Polyhedron) -> Iterator[str]:
    reached = row["hand_reached"]
    if bool(row["force_closed"]) != (reached is not None):
        yield f"hand_reached is {reached}, but force_closed is {row['force_closed']}"
    elif reached is not None and reached == bool(row["hand_reason"]):
        yield f"hand_reason is {row['hand_reason']!r}, but hand_reached is {reached}"
    elif reached:
        fingers = row["hand_fingers"]
        if len(set(fingers)) < FINGERS or not set(fingers) <= set(range(len(hand.fingers))):
            yield f"hand_fingers are {fingers}, not {FINGERS} of the hand's {len(hand.fingers)}"
            return
        yield from _motion_faults(row, hand)
        yield from _place_faults(row, hand, body)


def _motion_faults(row: Row, hand: Hand) -> Iterator[str]:
    low, high = hand.ranges.T
    for name in ("hand_joints_rad", "hand_open_joints_rad"):
        if row[name] is not None:
            angles = np.array(row[name])
            if (angles < low - ROUNDED).any() or (angles > high + ROUNDED).any():
                yield f"{name} are not within the ranges of the joints"
    pose = np.array(row["T_object_palm_m"])
    turn = pose[:3, :3]
    off = float(np.abs(turn @ turn.T - np.eye(3)).max())
    if off > ROUNDED or np.linalg.det(turn) < 0.0 or pose[3].tolist() != np.eye(POSE)[3].tolist():
        yield "T_object_palm_m is not a rigid motion"
    way = row["hand_approach"]
    if way is not None and abs(np.linalg.norm(way) - 1.0) > ROUNDED:
        yield "hand_approach is not of unit length"


def _place_faults(row: Row, hand: Hand, body: Polyhedron) -> Iterator[str]:
    joints, pose = np.array(row["hand_joints_rad"]), np.array(row["T_object_palm_m"])
    fingers: list[int] = row["hand_fingers"]
    points, normals = np.array(row["hand_points_m"]), np.array(row["hand_normals"])
    surface = Surface(body.vertices, body.triangles)
    pairs = zip(points, normals, strict=True)
    if not all(surface.holds(point, normal, TOUCHES_M) for point, normal in pairs):
        yield "hand_points_m are not on the object, or hand_normals not its normals there"
    roundings = np.array([hand.fingers[finger].tip.core[1] for finger in fingers])
    behind = points - roundings[:, None] * normals  # within the tips, as deep as they are rounded
    if (tip_distances(hand, joints, pose, fingers, behind) + roundings).max() > TOUCHES_M:
        yield "the fingertips of hand_joints_rad do not touch the object at hand_points_m"
    found = clearances(hand, body, joints, pose, np.array(fingers))
    # a link whose tip touches the object may come as near to it as it likes
    if found.itself < APART_M or found.object < -ROUNDED or found.tips < -TOUCHES_M:
        yield "the hand of hand_joints_rad overlaps the object or itself"
    try:
        certificate = force_closure(points, normals, row["friction"])
        proved = certificate.closed and certificate.verify()
    except GraspError:
        proved = False
    if not proved:
        yield "hand_points_m are not proved to be in force closure"
