"""Charts of the wrenches that a grasp can apply, projected onto three planes.

The set W of wrenches that contact forces with normal parts of sum 1 N can apply is convex, and its
farthest point along any direction is known. So its projection onto any plane can be drawn exactly:
it is bounded by the points of W farthest along each direction of the plane. The largest ball in W
around zero, whose radius is the Ferrari-Canny quality, is projected to a disc. The ball touches the
border of W in its weakest direction; in a plane that holds this direction, the limiting facet is a
line that touches the disc and the projection.
"""

from typing import Any

import numpy as np

from grasp_core.arrays import Array
from grasp_core.closure.wrench_sets import WrenchSet
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.quality.ferrari_canny import ferrari_canny
from grasp_core.values import Grasp
from scenes.drawing.canvas import entitle, figure_with_panels, in_style
from scenes.drawing.palette import BAD, GOOD, INK
from scenes.drawing.pictures import check_drawn
from scenes.drawing.views import View, best_view

TURNS = 181
"""Number of points on the border of a shadow; the first is also the last."""
SMALLEST_NORMAL = np.finfo(np.float64).tiny
"""Least number that is divided by: the smallest of full precision."""


@in_style
def wrench_figure(
    body: Polyhedron, grasp: Grasp, friction: float, *, view: View | None = None
) -> Any:
    """Draw projections of the wrench set: on its weakest direction, on forces and on torques.

    Args:
        body: The object.
        grasp: A grasp on the faces of `body`.
        friction: Coulomb coefficient.
        view: The view in which forces and torques are seen; None for that of the grasp's picture.

    Returns:
        A matplotlib figure.

    Raises:
        InputError: The grasp does not lie on the body, or the friction is out of range.
    """
    check_drawn(body, grasp, friction, view)
    view = view or best_view(body, grasp)
    quality = ferrari_canny(
        grasp, friction=friction, center=body.center_of_mass, torque_scale=body.radius
    )
    wrenches, radius = quality.wrenches, quality.upper
    right, up = view.axes[0], view.axes[1]
    still = np.zeros(3)
    figure, (weakest, forces, torques) = figure_with_panels(9.0, 3.1, 3)
    _shadow(weakest, wrenches, _weakest_plane(wrenches, quality.direction), radius)
    weakest.axvline(radius, color=BAD, linewidth=1.2, label="limiting facet")
    weakest.legend(loc="upper left")
    closed = "weakest direction" if radius > 0.0 else "not in force closure: zero is outside"
    _label(weakest, closed, f"along it [N], quality {radius:.3g}", "across it [N]")
    _shadow(forces, wrenches, np.array([[*right, *still], [*up, *still]]), radius)
    _label(forces, "forces", "to the right of the picture [N]", "up [N]")
    _shadow(torques, wrenches, np.array([[*still, *right], [*still, *up]]), radius)
    scale = f"torques over {1e3 * body.radius:.3g} mm"
    _label(torques, scale, "to the right of the picture [N]", "up [N]")
    return figure


def _weakest_plane(wrenches: WrenchSet, direction: Array) -> Array:
    """Return two unit vectors: the direction, and one towards the point farthest along it."""
    _, forces = wrenches.support(direction)
    point = wrenches.G @ forces
    across = point - (point @ direction) * direction
    length = float(np.linalg.norm(across))
    if length < 1e-9 * wrenches.size:
        axis = np.eye(6)[int(np.abs(direction).argmin())]
        across = axis - (axis @ direction) * direction
        length = float(np.linalg.norm(across))
    return np.array([direction, across / length])


def shadow_of(wrenches: WrenchSet, plane: Array) -> Array:
    """Compute the border of the projection of an `l1` wrench set onto a plane.

    Each point of the border is the wrench of one contact alone, whose force is at the rim of its
    cone.

    Args:
        wrenches: The wrench set.
        plane: Two unit wrenches, (2, 6), rows.

    Returns:
        Points of the border, (TURNS, 2), counter-clockwise.
    """
    angles = np.linspace(0.0, 2.0 * np.pi, TURNS)
    ways = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    slopes = (ways @ plane @ wrenches.G).reshape(TURNS, -1, 3)
    across = np.hypot(slopes[..., 1], slopes[..., 2])
    farthest = np.argmax(slopes[..., 0] + wrenches.friction * across, axis=1)
    rows = np.arange(TURNS)
    forces = np.zeros_like(slopes)
    forces[rows, farthest, 0] = 1.0
    sliding = wrenches.friction[farthest] / np.maximum(across[rows, farthest], SMALLEST_NORMAL)
    forces[rows, farthest, 1:] = slopes[rows, farthest, 1:] * sliding[:, None]
    return forces.reshape(TURNS, -1) @ (plane @ wrenches.G).T


def _shadow(axes: Any, wrenches: WrenchSet, plane: Array, radius: float) -> None:
    border = shadow_of(wrenches, plane)
    axes.fill(*border.T, facecolor=GOOD, alpha=0.22, edgecolor=GOOD, linewidth=1.2)
    angles = np.linspace(0.0, 2.0 * np.pi, TURNS)
    disc = max(radius, 0.0) * np.stack([np.cos(angles), np.sin(angles)])
    axes.fill(*disc, facecolor="none", edgecolor=INK, linewidth=1.2, hatch="////")
    axes.plot([0.0], [0.0], "+", color=INK)
    axes.set_aspect("equal", adjustable="datalim")


def _label(axes: Any, title: str, across: str, up: str) -> None:
    entitle(axes, title)
    axes.set_xlabel(across)
    axes.set_ylabel(up)
