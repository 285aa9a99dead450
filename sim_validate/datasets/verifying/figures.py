"""Checks figures that tables have on request: computed again from contacts, mesh and other cells.

Payloads are optima of programs that take long; only a sample of units computes them again.
"""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from grasp_core.arrays import Array
from grasp_core.geometry.nearest_points import nearest_on_triangles
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
FREE = 0.999
"""Share of the fingertip's radius that no other part of the object may be nearer than."""
STEPS = 8
"""Number of places on a free line at which its distance from the object is checked."""


def figure_faults(folder: Path, config: DatasetConfig, rows: ObjectRows) -> Iterator[str]:
    """Yield sentences on what is wrong with figures of the grasps of one object."""
    if config.learning is None:
        return
    figures, asked = Figures(config.learning, config.execution), config.learning.hand
    trials: dict[str, list[Row]] = {}
    for row in rows.get("executions", ()):
        trials.setdefault(row["grasp_id"], []).append(row)
    names = {row["grasp_id"]: row for row in rows["grasps"]}
    for of_object in rows["objects"]:
        own = [row for row in rows["grasps"] if row["object_id"] == of_object["object_id"]]
        body = stored_body(folder, of_object["object_id"], of_object["source_name"], config.faces)
        for row in own:
            found = [
                *_closure_faults(row, body, figures),
                *_symmetry_faults(row, names),
                *_approach_faults(row, body),
                *_margin_faults(row, trials.get(row["grasp_id"], [])),
                *(hand_pose_faults(row, hand_named(asked), body) if asked else ()),
            ]
            yield from (f"grasps: {row['grasp_id']}: {fault}" for fault in found)


def _closure_faults(row: Row, body: Polyhedron, figures: Figures) -> Iterator[str]:
    if "min_weight" not in row or row["force_closed"] is None:
        return
    count = row["contacts"]
    places = zip(row["contact_points_m"][:count], row["contact_normals"][:count], strict=True)
    contacts = [Contact(np.array(point), np.array(normal)) for point, normal in places]
    for name, value in figures.of_contacts(body, contacts, row["friction"]).items():
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


def _symmetry_faults(row: Row, names: Mapping[str, Row]) -> Iterator[str]:
    if (first := row.get("symmetry_class")) is None:
        return
    other = names.get(first)
    if other is None or other["symmetry_class"] != first:
        yield f"{first}, named in symmetry_class, is not the first of its class"
    elif other["multiplicity"] != row["multiplicity"]:
        yield f"multiplicity is {row['multiplicity']}, but {first} has {other['multiplicity']}"


def _approach_faults(row: Row, body: Polyhedron) -> Iterator[str]:
    """Check that on the way to its contact no finger meets the object, whose faces are planar."""
    if row.get("approach_directions") is None or body.patches is not None:
        return
    radius, corners = row["approach_radius_m"], body.vertices[body.triangles]
    tips = np.array(row["contact_points_m"]) - radius * np.array(row["contact_normals"])
    ways: Array = np.array(row["approach_directions"], dtype=np.float64)
    for tip, way in zip(tips, ways, strict=True):
        for place in tip - np.linspace(0.0, body.radius, STEPS)[:, None] * way:
            away = nearest_on_triangles(corners, place) - place
            if np.linalg.norm(away, axis=1).min() < FREE * radius:
                yield "a finger on its way along approach_directions meets the object"
                return


def _margin_faults(row: Row, trials: Sequence[Row]) -> Iterator[str]:
    if not row.get("executed") or "payload_kg" not in row:
        return
    carried = row["load_multiple"] * row["mass_kg"]
    if not np.isclose(row["payload_kg"], carried, rtol=SAME, atol=0.0):
        yield f"payload_kg is {row['payload_kg']}, but load_multiple times the mass is {carried}"
    losses = [trial["predicted_loss"] for trial in trials if trial["predicted_loss"] is not None]
    if row["predicted_loss"] != min(losses, default=None):
        yield f"predicted_loss is {row['predicted_loss']}, but not by the table of executions"
