"""Places the camera, and chooses the view that shows a grasp best."""

import math
from dataclasses import dataclass
from typing import Self

import numpy as np

from grasp_core.arrays import Array, frozen
from grasp_core.checked import number, positive
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
class View:
    """A camera that looks at a point, with z of the object's frame upwards."""

    axes: Array
    """Unit vectors to the right, up and towards the viewer, (3, 3), rows."""
    center: Array
    """The point that the camera looks at, (3,) [m]."""
    distance: float
    """Distance of the camera from `center` [m]."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "axes", frozen(self.axes, (3, 3), "axes"))
        object.__setattr__(self, "center", frozen(self.center, (3,), "center"))
        positive(self.distance, "distance")

    @classmethod
    def of_angles(cls, azimuth_deg: float, elevation_deg: float, body: Polyhedron) -> Self:
        """Place a camera by its azimuth and elevation [deg] as seen from the object."""
        number(azimuth_deg, "azimuth_deg")
        number(elevation_deg, "elevation_deg")
        axes = _axes(math.radians(azimuth_deg), math.radians(elevation_deg))
        return cls(axes, body.center_of_mass, DISTANCE * body.radius)

    def seen(self, points: Array) -> tuple[Array, Array]:
        """Project points (n, 3) to the picture, (n, 2) [m], with their nearness, (n,) [m]."""
        turned = (points - self.center) @ self.axes.T
        nearness = turned[:, 2]
        scale = self.distance / np.maximum(self.distance - nearness, 0.1 * self.distance)
        return turned[:, :2] * scale[:, None], nearness


def _axes(azimuth: float, elevation: float) -> Array:
    flat = np.array([math.cos(azimuth), math.sin(azimuth), 0.0])
    up = np.array([0.0, 0.0, 1.0])
    towards = math.cos(elevation) * flat + math.sin(elevation) * up
    right = np.cross(up, flat)
    return np.array([right, np.cross(towards, right), towards])


def best_view(body: Polyhedron, grasp: Grasp) -> View:
    """Choose a view that keeps contacts and fingers apart and shows few faces edge-on."""
    outward = -grasp.normals if grasp.approach_directions is None else -grasp.approach_directions
    ends = grasp.positions + body.radius * outward
    areas = np.array([face.area for face in body.faces])
    angles = [(azimuth, elevation) for elevation in ELEVATIONS for azimuth in AZIMUTHS]

    def merit(angle: tuple[int, int]) -> float:
        view = View.of_angles(*angle, body)
        towards = view.axes[2]
        apart = _least_gap(view.seen(np.vstack([grasp.positions, ends]))[0]) / body.radius
        pointing = np.maximum(np.abs(outward @ towards) - FORESHORTENED, 0.0).sum()
        lines = areas @ (np.abs(body.normals @ towards) < EDGE_ON) / areas.sum()
        in_front = (outward @ towards > SAME_MERIT).mean()
        return apart + 0.1 * in_front - 2.0 * float(pointing) - 0.5 * float(lines)

    best = first_best([merit(angle) for angle in angles], SAME_MERIT)
    return View.of_angles(*angles[best], body)


def _least_gap(points: Array) -> float:
    """Return the smallest distance between any two of several points, (n, 2) [m]."""
    gaps = np.linalg.norm(points[:, None] - points[None], axis=2)
    return float(gaps[np.triu_indices(len(points), 1)].min())
