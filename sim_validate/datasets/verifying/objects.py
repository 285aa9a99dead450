"""Checks what tables say about objects on request: shapes, points, resting poses, and splits."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from grasp_core.geometry.nearest_points import Surface
from grasp_core.objects.polyhedron import Polyhedron
from sim_validate.datasets.config import DatasetConfig
from sim_validate.datasets.learning.objects import box_sides, rest_rows, shape_class
from sim_validate.datasets.learning.splitting import assigned
from sim_validate.datasets.meshes import stored_body
from sim_validate.datasets.open_dataset import Selection
from sim_validate.datasets.verifying.rows_by_object import ObjectRows, Row

SAME = 1e-6
"""Share of a length that processors may round differently."""
ON_IT = 1e-9
"""Distance of drawn points from the surface, in object radii."""


def object_faults(folder: Path, config: DatasetConfig, rows: ObjectRows) -> Iterator[str]:
    """Yield sentences on what is wrong with the units, shapes, points and rests of objects."""
    asked = config.learning
    for row in rows["objects"]:
        name = row["source_name"]
        if "scale" in row and (row["unit"], row["scale"]) != config.lengths_of(name):
            yield f"objects: unit and scale of {name} are not those of the settings"
        if asked is None:
            continue
        body = stored_body(folder, row["object_id"], name, config.faces)
        if row["shape_class"] != asked.classes.get(name, shape_class(body)):
            yield f"objects: shape_class of {name} is not that of its mesh"
        if not np.allclose(row["box_sides_m"], box_sides(body), rtol=0.0, atol=SAME * body.radius):
            yield f"objects: box_sides_m of {name} are not those of its mesh"
        if asked.points and not _are_on(row, body):
            yield f"objects: cloud_points_m of {name} are not on it, or not with its normals"
        if asked.rests and not _are_rests(rows, body):
            yield f"rests: resting poses of {name} are not those of its mesh"


def _are_on(row: Row, body: Polyhedron) -> bool:
    surface, slack = Surface(body.vertices, body.triangles), ON_IT * body.radius
    places = zip(row["cloud_points_m"], row["cloud_normals"], strict=True)
    return all(surface.holds(np.array(p), np.array(n), slack) for p, n in places)


def _are_rests(rows: ObjectRows, body: Polyhedron) -> bool:
    wanted = list(rest_rows(body))
    own = [each for each in rows["rests"] if each["object_id"] == body.content_sha256]
    return len(own) == len(wanted) and all(
        np.allclose(*(np.hstack([each[key] for key in PLACES]) for each in pair), atol=SAME)
        for pair in zip(own, wanted, strict=True)
    )


PLACES = ("down", "height_m", "likelihood")
"""Columns by which resting poses are compared."""


def split_faults(everything: Selection, config: DatasetConfig) -> Iterator[str]:
    """Yield a sentence on each object that is in another split than counting puts it."""
    if config.learning is None or not config.counts_splits:
        return
    rows = {row["object_id"]: row for row in everything.rows("objects")}
    classes = {name: row["shape_class"] for name, row in rows.items()}
    wanted = assigned(classes, config.learning.split_by, config.seed)
    yield from (
        f"objects: {row['source_name']} is in the split {row['split']}, but belongs in "
        f"{wanted[name]}"
        for name, row in rows.items()
        if row["split"] != wanted[name]
    )
