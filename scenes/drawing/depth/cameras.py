"""Places depth cameras around an object, or above a table on which it lies.

A pinhole camera looks along the z axis of its frame; x points right and y down in the image. A
point (x, y, z) in that frame appears at

    u = f x / z + width / 2,    v = f y / z + height / 2,                                  (1)

in pixels from the upper left corner of the image, so that the middle of pixel (row, column) is at
(column + 1/2, row + 1/2). The camera's distance from the centre of mass is such that the
sphere around the object fits into the image in every direction.
"""

import math
from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array, frozen
from grasp_core.checked import number, whole
from grasp_core.frames import POSE

MOST_PIXELS, MOST_FIELD = 4096, math.radians(120.0)
ROOM = 1.05
"""Distance of a camera over the least at which the sphere around the object fits its image."""
LOWEST, HIGHEST = math.radians(20.0), math.radians(80.0)
"""Least and largest elevation of a camera above a table [rad]."""
GOLDEN = math.pi * (3.0 - math.sqrt(5.0))
"""Turn from one point of a spiral on a sphere to the next that keeps them apart [rad]."""


@dataclass(frozen=True, slots=True)
class Lens:
    """Size of the images and the field of view of a pinhole camera.

    Raises:
        InputError: A number is out of range.
    """

    width: int = 128
    """Columns of an image [pixels]."""
    height: int = 128
    """Rows of an image [pixels]."""
    field_rad: float = math.radians(40.0)
    """Angle between the upper and the lower border of the image [rad]."""

    def __post_init__(self) -> None:
        whole(self.width, "width", least=1, most=MOST_PIXELS)
        whole(self.height, "height", least=1, most=MOST_PIXELS)
        number(self.field_rad, "field_rad", above=0.0, most=MOST_FIELD)

    @property
    def focal_length(self) -> float:
        """Return f in (1) [pixels]."""
        return 0.5 * self.height / math.tan(0.5 * self.field_rad)

    @property
    def matrix(self) -> Array:
        """Return the matrix K of (1), (3, 3) [pixels]: K (x, y, z) = z (u, v, 1)."""
        f, middle = self.focal_length, (0.5 * self.width, 0.5 * self.height)
        return frozen([[f, 0.0, middle[0]], [0.0, f, middle[1]], [0.0, 0.0, 1.0]], (3, 3), "K")

    def distance(self, radius: float) -> float:
        """Return the distance at which a sphere of a radius fits into the image [m]."""
        narrow = math.atan(0.5 * min(self.width, self.height) / self.focal_length)
        return ROOM * radius / math.sin(narrow)


def around(center: Array, distance: float, count: int, rng: np.random.Generator) -> Array:
    """Place cameras on a sphere, evenly: a spiral of points that is turned at random.

    Takes `center` (3,) [m]; `distance` [m]. Gives poses of the cameras' frames, (count, 4, 4).
    """
    heights = 1.0 - 2.0 * (np.arange(count) + 0.5) / count
    across, turns = np.sqrt(1.0 - heights**2), GOLDEN * np.arange(count)
    spiral = np.stack([across * np.cos(turns), across * np.sin(turns), heights], axis=1)
    ways = spiral @ _random_rotation(rng).T
    ups = rng.normal(size=(count, 3))
    return np.array(
        [looking(center + distance * way, -way, up) for way, up in zip(ways, ups, strict=True)]
    )


def above(center: Array, distance: float, ups: Array, rng: np.random.Generator) -> Array:
    """Place cameras above a table, each upright, as likely at any azimuth.

    Takes `center` (3,) [m]; `distance` [m]; `ups` (n, 3). Gives poses of the cameras' frames, (n,
    4, 4).
    """
    poses = list[Array]()
    for up in ups:
        elevation, about = rng.uniform(LOWEST, HIGHEST), rng.normal(size=3)
        level = about - (about @ up) * up
        level /= np.linalg.norm(level)
        way = math.cos(elevation) * level + math.sin(elevation) * up
        poses.append(looking(center + distance * way, -way, up))
    return np.array(poses).reshape(-1, POSE, POSE)


def looking(place: Array, way: Array, up: Array) -> Array:
    """Return the pose of a camera that stands at a place and looks along a unit direction.

    Takes `place` (3,) [m]; `way`, `up` (3,). Gives pose of the camera's frame, (4, 4).
    """
    right = np.cross(way, up)
    right = right / np.linalg.norm(right)
    pose = np.eye(POSE)
    pose[:3, :3] = np.column_stack([right, np.cross(way, right), way])
    pose[:3, 3] = place
    return pose


def _random_rotation(rng: np.random.Generator) -> Array:
    """Draw a rotation matrix, as likely any, (3, 3)."""
    turned, scaled = np.linalg.qr(rng.normal(size=(3, 3)))
    turned = turned * np.sign(np.diag(scaled))
    return turned * np.sign(np.linalg.det(turned))
