"""Draws depth images of objects with MuJoCo's renderer, in a separate process.

Depths come from the renderer's depth buffer of 32 bits. Pixels on an outline may fall on either
side of it, as the graphics library draws, so that images from different machines are alike but not
the same to the last bit.
"""

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array
from grasp_core.objects.polyhedron import Polyhedron
from scenes.drawing.clips import drawn_by_first
from scenes.drawing.depth.cameras import Lens
from scenes.mjcf_text import add_element, document, element, quaternion

NEAR, FAR = 0.02, 50.0
"""Distances of the planes between which the renderer draws, over the camera's distance."""
TABLE_SIZE = 40.0
"""Half the side of the table, in object radii: it ends about two degrees below the horizon."""
THICK = 0.5
"""Half the thickness of the table, in object radii."""
FLIPPED = np.diag([1.0, -1.0, -1.0])
"""Turn from a camera frame with z along the view to MuJoCo's, whose z points back and y up."""


@dataclass(frozen=True, slots=True, eq=False)
class Views:
    """What is drawn: an object, the cameras that look at it, and the table under it in each."""

    body: Polyhedron
    cameras: Array
    """Poses of the cameras' frames in the object's frame, (n, 4, 4)."""
    lens: Lens
    tables: Array | None = None
    """Pose of the table's frame in the object's frame for each camera, (n, 4, 4): the table is
    below its plane z = 0. None for no table."""


@dataclass(frozen=True, slots=True, eq=False)
class DepthImages:
    """What depth cameras see."""

    depth_m: NDArray[np.float32]
    """Distance of what is seen along each camera's z axis, zero where nothing is, (n, h, w)
    [m]."""
    on_object: NDArray[np.bool_]
    """Whether the object is seen, (n, h, w)."""


def depth_images(asked: Sequence[Views]) -> list[DepthImages]:
    """Draw depth images of objects, all in one process."""
    with tempfile.TemporaryDirectory() as folder:
        pairs = list[tuple[Path, Path]]()
        for number, views in enumerate(asked):
            job = Path(folder) / f"{number}-job.npz"
            size = (views.lens.width, views.lens.height)
            np.savez(job, xml=_scene(views), size=size, views=len(views.cameras))
            pairs.append((job, Path(folder) / f"{number}.npz"))
        drawn_by_first(pairs)
        return [_read(out) for _, out in pairs]


def _read(path: Path) -> DepthImages:
    with np.load(path, allow_pickle=False) as found:
        return DepthImages(found["depth_m"], found["on_object"])


def _scene(views: Views) -> str:
    """Write an object, its cameras and tables as MJCF; table k belongs to camera k."""
    body, lens = views.body, views.lens
    away = float(np.linalg.norm(views.cameras[:, :3, 3] - body.center_of_mass, axis=1).max())
    root = element("mujoco", {"model": "depth"})
    add_element(root, "statistic", {"extent": 1.0, "center": body.center_of_mass})
    visual = add_element(root, "visual", {})
    add_element(visual, "map", {"znear": NEAR * away, "zfar": FAR * away})
    add_element(visual, "quality", {"offsamples": 0})  # several samples would blur depths
    sizes = {"offwidth": lens.width, "offheight": lens.height}
    add_element(visual, "global", {**sizes, "fovy": np.degrees(lens.field_rad)})
    assets = add_element(root, "asset", {})
    mesh = {"vertex": body.vertices.ravel(), "face": body.triangles.ravel()}
    add_element(assets, "mesh", {"name": "object", "inertia": "shell", **mesh})
    world = add_element(root, "worldbody", {})
    add_element(world, "geom", {"name": "object", "type": "mesh", "mesh": "object"})
    for number, pose in enumerate(views.cameras):
        turned = {"pos": pose[:3, 3], "quat": quaternion(pose[:3, :3] @ FLIPPED)}
        add_element(world, "camera", {"name": f"view{number}", **turned,
                                      "fovy": np.degrees(lens.field_rad)})  # fmt: skip
    for number, pose in enumerate(() if views.tables is None else views.tables):
        half = THICK * body.radius
        add_element(world, "geom", {
            "name": f"table{number}", "type": "box", "quat": quaternion(pose[:3, :3]),
            "pos": pose[:3, 3] - half * pose[:3, 2],
            "size": [TABLE_SIZE * body.radius, TABLE_SIZE * body.radius, half],
        })  # fmt: skip
    return document(root)
