"""Writes depth images of the objects of a dataset, seen from all around or lying on a table."""

import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from grasp_core.checked import seed_of, switch, whole
from grasp_core.errors import InputError
from grasp_core.files.text_files import write_text
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.provenance import versions
from scenes.drawing.depth.cameras import Lens, above, around
from scenes.drawing.depth.depth_images import Views, depth_images
from sim_validate.datasets.learning.objects import rest_rows
from sim_validate.datasets.meshes import stored_body
from sim_validate.datasets.open_dataset import Selection
from sim_validate.files.writing import whole_folder, write_arrays

INDEX = "depths.json"
MOST_VIEWS, MOST_PIXELS = 1000, 200_000_000
"""Largest numbers of images of an object, and of their pixels, which are a gigabyte."""
MOST_OBJECTS, BATCH = 8, 64
"""Numbers of objects, and of images unless one object has more, that one process draws."""


@dataclass(frozen=True, slots=True)
class AskedDepths:
    """Which depth images are drawn of each object.

    Raises:
        InputError: A number is out of range.
    """

    views: int = 8
    """Number of images of each object."""
    on_table: bool = False
    """Whether the object lies on a table, in resting poses drawn by their likelihood."""
    seed: int = 0
    """Seed of the places of cameras and of the resting poses."""
    lens: Lens = field(default_factory=Lens)

    def __post_init__(self) -> None:
        whole(self.views, "views", least=1, most=MOST_VIEWS)
        switch(self.on_table, "on_table")
        seed_of(self.seed)
        if (pixels := self.views * self.lens.width * self.lens.height) > MOST_PIXELS:
            raise InputError(
                f"views, width and height: expected at most {MOST_PIXELS} pixels for each object, "
                f"got {pixels}; draw fewer or smaller images, with several seeds if need be"
            )

    @property
    def batch(self) -> int:
        """Number of objects that one process draws before it ends."""
        return max(1, min(MOST_OBJECTS, BATCH // self.views))


@dataclass(frozen=True, slots=True, eq=False)
class _Seen:
    """An object, what is drawn of it, and where it lies in each image."""

    row: dict[str, Any]
    views: Views
    rests: NDArray[np.int64] | None
    """Number of the resting pose in each image, (n,), as in the table `rests`."""


def write_depths(
    out: Path, chosen: Selection, asked: AskedDepths, report: Callable[[int, int], None]
) -> int:
    """Write a file of depth images for each object, and an index of them.

    Takes `report` (drawn, total). Gives number of objects.
    """
    faces, total, listed = chosen.config().faces, chosen.counts()["objects"], list[Any]()
    with whole_folder(out) as folder:
        seen = (
            _seen(
                row, stored_body(chosen.folder, row["object_id"], row["source_name"], faces), asked
            )
            for row in chosen.rows("objects")
        )
        while batch := list(islice(seen, asked.batch)):
            listed += _written(folder, batch)
            report(len(listed), total)
        settings = asdict(asked) | {"units": "metres; pixels count from the upper left corner"}
        about = {
            "schema": 1, "dataset": chosen.facts(), "settings": settings, "versions": versions(),
            "objects": listed,
        }  # fmt: skip
        write_text(folder / INDEX, json.dumps(about, indent=1) + "\n")
    return len(listed)


def _seen(row: dict[str, Any], body: Polyhedron, asked: AskedDepths) -> _Seen:
    """Place the cameras of one object; the seed and the object alone decide where."""
    digest = hashlib.sha256(f"{asked.seed} {row['object_id']} depths".encode()).digest()
    rng = np.random.default_rng(int.from_bytes(digest[:16], "big"))
    distance = asked.lens.distance(body.radius)
    if not asked.on_table:
        cameras = around(body.center_of_mass, distance, asked.views, rng)
        return _Seen(row, Views(body, cameras, asked.lens), None)
    resting = list(rest_rows(body))
    if not resting:
        raise InputError(
            f"{row['source_name']}: expected a face of its hull on which the object rests, found "
            "none; leave out --on-table"
        )
    shares = np.array([rest["likelihood"] for rest in resting])
    chosen = rng.choice(len(resting), size=asked.views, p=shares / shares.sum())
    poses = np.array([resting[number]["T_table_object_m"] for number in chosen], dtype=np.float64)
    tables = np.asarray(np.linalg.inv(poses), dtype=np.float64)
    cameras = above(body.center_of_mass, distance, tables[:, :3, 2], rng)
    return _Seen(row, Views(body, cameras, asked.lens, tables), chosen)


def _written(folder: Path, batch: Sequence[_Seen]) -> list[dict[str, Any]]:
    """Draw some objects, write their files, and return what the index says of them."""
    listed = list[dict[str, Any]]()
    for seen, images in zip(batch, depth_images([each.views for each in batch]), strict=True):
        views, name = seen.views, seen.row["object_id"]
        arrays: dict[str, NDArray[Any]] = {
            "depth_m": images.depth_m, "on_object": images.on_object, "K": views.lens.matrix,
            "T_object_camera_m": views.cameras,
        }  # fmt: skip
        if views.tables is not None and seen.rests is not None:
            arrays |= {"T_object_table_m": views.tables, "rest": seen.rests}
        path = Path(seen.row["split"]) / f"{name}.npz"
        write_arrays(folder / path, arrays)
        listed.append({
            "object_id": name, "source_name": seen.row["source_name"],
            "split": seen.row["split"], "path": path.as_posix(),
        })  # fmt: skip
    return listed
