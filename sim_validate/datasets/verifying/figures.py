"""Checks figures that tables have on request: computed again from contacts and other cells."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import Contact
from sim_validate.datasets.config import DatasetConfig
from sim_validate.datasets.learning.figures import Figures
from sim_validate.datasets.learning.hand_poses import hand_named
from sim_validate.datasets.meshes import stored_body
from sim_validate.datasets.verifying.hand_poses import hand_pose_faults
from sim_validate.datasets.verifying.rows_by_object import ObjectRows, Row

SAME = 1e-6
"""Share of a figure that processors may round differently."""
OFF = 1e-9
"""Wrench that balanced forces leave, relative to the forces, at object radius one."""


def figure_faults(folder: Path, config: DatasetConfig, rows: ObjectRows) -> Iterator[str]:
    """Yield sentences on what is wrong with figures of the grasps of one object."""
    if config.learning is None:
        return
    figures, asked = Figures(config.learning, config.execution), config.learning.hand
    trials: dict[str, list[Row]] = {}
    for row in rows.get("executions", ()):
        trials.setdefault(row["grasp_id"], []).append(row)
    for of_object in rows["objects"]:
        own = [row for row in rows["grasps"] if row["object_id"] == of_object["object_id"]]
        body = stored_body(folder, of_object["object_id"], of_object["source_name"], config.faces)
        for row in own:
            found = [
                *_closure_faults(row, body, figures),
                *_margin_faults(row, trials.get(row["grasp_id"], [])),
                *(hand_pose_faults(row, hand_named(asked), body) if asked else ()),
            ]
            yield from (f"grasps: {row['grasp_id']}: {fault}" for fault in found)


def _closure_faults(row: Row, body: Polyhedron, figures: Figures) -> Iterator[str]:
    if "span_angle_rad" not in row or row["force_closed"] is None:
        return
    count = row["contacts"]
    places = zip(row["contact_points_m"][:count], row["contact_normals"][:count], strict=True)
    contacts = [Contact(np.array(point), np.array(normal)) for point, normal in places]
    for name, value in figures.of_contacts(body, contacts).items():
        stated = row[name]
        if (stated is None) != (value is None) or (
            value is not None and not np.isclose(stated, value, rtol=SAME, atol=SAME)
        ):
            yield f"{name} is {stated}, but from the contacts it is {value}"
    if row["witness_forces_n"] is not None:
        yield from _witness_faults(row, body)


def _witness_faults(row: Row, body: Polyhedron) -> Iterator[str]:
    """Check that forces balance, are in their cones, and have normal parts whose sum is one."""
    forces, normals = np.array(row["witness_forces_n"]), np.array(row["contact_normals"])
    arms = (np.array(row["contact_points_m"]) - body.center_of_mass) / body.radius
    pushes = np.einsum("ki,ki->k", forces, normals)
    across = np.linalg.norm(forces - pushes[:, None] * normals, axis=1)
    left = np.concatenate([forces.sum(axis=0), np.cross(arms, forces).sum(axis=0)])
    in_cones = (across <= row["friction"] * pushes * (1.0 + SAME) + OFF).all()
    if not in_cones or np.abs(left).max() > SAME or abs(pushes.sum() - 1.0) > SAME:
        yield "witness_forces_n are no balanced forces in the friction cones"


def _margin_faults(row: Row, trials: Sequence[Row]) -> Iterator[str]:
    if not row.get("executed") or "payload_kg" not in row:
        return
    carried = row["load_multiple"] * row["mass_kg"]
    if not np.isclose(row["payload_kg"], carried, rtol=SAME, atol=0.0):
        yield f"payload_kg is {row['payload_kg']}, but load_multiple times the mass is {carried}"
    losses = [trial["predicted_loss"] for trial in trials if trial["predicted_loss"] is not None]
    if row["predicted_loss"] != min(losses, default=None):
        yield f"predicted_loss is {row['predicted_loss']}, but not by the table of executions"
