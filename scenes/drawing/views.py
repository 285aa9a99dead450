"""Places the camera, and chooses the view that shows a grasp best."""

import math
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Self, TypeAlias

import numpy as np

from grasp_core.arrays import Array, Point, Shape
from grasp_core.declared import Declared
from grasp_core.kinds import Quantity, number
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.solvers.ties import first_best
from grasp_core.values import Grasp

DISTANCE = 9.0
"""Distance of the camera, in object radii: perspective is visible, and distortion is small."""
AZIMUTHS, ELEVATIONS = range(5, 360, 10), (18, 28, 40)
"""Azimuths and elevations of the views to choose from [deg]."""
EDGE_ON = 0.12
"""Cosine of the angle between a face's normal and the line of sight below which the face is seen
nearly as a line."""
SAME_MERIT = 1e-6
"""Largest difference of merit at which two views count as equally good; the first one is then
taken."""
FORESHORTENED = 0.8
"""Cosine of the angle to the line of sight above which a finger points at the viewer."""


@dataclass(frozen=True, slots=True, eq=False)
class Alone:
    """The extent of what is drawn beside an object, as a ball around it."""

    center_of_mass: Array
    radius: float


Extent: TypeAlias = Polyhedron | Alone
"""The place and size of what is drawn: of an object, or of a grasp or hand beside it."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class View(Declared):
    """A camera that looks at a point, with z of the object's frame upwards."""

    axes: Annotated[Array, Shape(3, 3)]
    """Unit vectors to the right, up and towards the viewer, (3, 3), rows."""
    center: Point
    distance: Quantity

    @classmethod
    def of_angles(cls, azimuth_deg: float, elevation_deg: float, body: Extent) -> Self:
        """Place a camera by its azimuth and elevation [deg] as seen from the object."""
        number(azimuth_deg, "azimuth_deg")
        number(elevation_deg, "elevation_deg")
        axes = _axes(math.radians(azimuth_deg), math.radians(elevation_deg))
        return cls(axes, body.center_of_mass, DISTANCE * body.radius)

    @property
    def camera(self) -> Array:
        """The place of the camera, (3,) [m]."""
        return self.center + self.distance * self.axes[2]

    def seen(self, points: Array) -> tuple[Array, Array]:
        """Project points (n, 3) to the picture, (n, 2) [m], with their nearness, (n,) [m]."""
        turned = (points - self.center) @ self.axes.T
        nearness = turned[:, 2]
        return turned[:, :2] * _enlarged(nearness, self.distance)[:, None], nearness


def _axes(azimuth: float, elevation: float) -> Array:
    flat = np.array([math.cos(azimuth), math.sin(azimuth), 0.0])
    up = np.array([0.0, 0.0, 1.0])
    towards = math.cos(elevation) * flat + math.sin(elevation) * up
    right = np.cross(up, flat)
    return np.array([right, np.cross(towards, right), towards])


def approaches(grasp: Grasp) -> Array:
    """Return the directions in which the fingers of a grasp come in, (4, 3)."""
    return grasp.normals if grasp.approach_directions is None else grasp.approach_directions


def best_view(body: Polyhedron, grasp: Grasp) -> View:
    """Choose a view that keeps contacts and fingers apart and shows few faces edge-on."""
    outward = -approaches(grasp)
    ends = grasp.positions + body.radius * outward
    angles, axes = views_at(ELEVATIONS)
    fingers = axes[:, 2] @ outward.T
    apart = least_gaps(axes, np.vstack([grasp.positions, ends]), body) / body.radius
    pointing = np.maximum(np.abs(fingers) - FORESHORTENED, 0.0).sum(axis=1)
    in_front = (fingers > SAME_MERIT).mean(axis=1)
    merits = apart + 0.1 * in_front - 2.0 * pointing - 0.5 * edge_on(body, axes)
    return View.of_angles(*angles[first_best(merits, SAME_MERIT)], body)


def edge_on(body: Polyhedron, axes: Array) -> Array:
    """Return the share of an object's surface that is seen nearly as lines in each view, (n,)."""
    areas = np.array([face.area for face in body.faces])
    return (np.abs(axes[:, 2] @ body.normals.T) < EDGE_ON) @ areas / areas.sum()


@cache
def views_at(elevations: tuple[int, ...]) -> tuple[list[tuple[int, int]], Array]:
    """Return the angles of views from all around at elevations [deg], and their axes, (n, 3, 3)."""
    angles = [(azimuth, elevation) for elevation in elevations for azimuth in AZIMUTHS]
    axes = [_axes(math.radians(azimuth), math.radians(elevation)) for azimuth, elevation in angles]
    return angles, np.array(axes)


def least_gaps(axes: Array, points: Array, body: Extent) -> Array:
    """Return the smallest distance between any two points (p, 3) in each picture, (n,) [m]."""
    turned = (points - body.center_of_mass) @ axes.transpose(0, 2, 1)
    flat = turned[..., :2] * _enlarged(turned[..., 2], DISTANCE * body.radius)[..., None]
    first, second = np.triu_indices(len(points), 1)
    return np.linalg.norm(flat[:, first] - flat[:, second], axis=2).min(axis=1)


def _enlarged(nearness: Array, distance: float) -> Array:
    """Return by which factor perspective enlarges what is at some nearness [m], of any shape."""
    return distance / np.maximum(distance - nearness, 0.1 * distance)
