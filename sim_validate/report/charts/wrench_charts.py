"""Charts of the wrenches that a grasp can apply, projected onto three planes.

The set W of wrenches that contact forces with normal parts of sum 1 N can apply is convex, and its
farthest point along any direction is known. So its projection onto any plane can be drawn exactly:
it is bounded by the points of W farthest along each direction of the plane. The largest ball in W
around zero, whose radius is the Ferrari-Canny quality, is projected to a disc. The ball touches the
border of W in its weakest direction; in a plane that holds this direction, the limiting facet is a
line that touches the disc and the projection.
"""

import math

import numpy as np

from grasp_core.arrays import Array
from grasp_core.closure.wrench_sets import WrenchSet
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.quality.ferrari_canny import ferrari_canny
from grasp_core.values import Grasp
from scenes.drawing.colours import BAD, GOOD, INK
from scenes.drawing.panels import ROW, Entry, Panel, Scale, keyed, thinned, ticks_in
from scenes.drawing.pictures import check_drawn
from scenes.drawing.sheets import Area, Line, Mark, Sheet, beside, circle, outlined
from scenes.drawing.views import View, best_view

WIDTH, HEIGHT = 300.0, 338.0
PLACE = (62.0, 28.0, 224.0)
"""Left and upper border of the square in which a panel draws, and its side [pixels]."""
AROUND = 0.55
"""Half of the range of an axis, relative to the extent of what is drawn."""
HATCHES = 7
"""Number of lines that hatch the disc."""
CROSS = (((-1.0, 0.0), (1.0, 0.0)), ((0.0, -1.0), (0.0, 1.0)))
"""The lines of the cross at zero."""
TURNS = 181
"""Number of points on the border of a shadow; the first is also the last."""
SMALLEST_NORMAL = np.finfo(np.float64).tiny
"""Least number that is divided by: the smallest of full precision."""


def wrench_figure(
    body: Polyhedron, grasp: Grasp, friction: float, *, view: View | None = None
) -> Sheet:
    """Draw projections of the wrench set: on its weakest direction, on forces and on torques.

    Args:
        body: The object.
        grasp: A grasp on the faces of `body`.
        friction: Coulomb coefficient.
        view: The view in which forces and torques are seen; None for that of the grasp's picture.

    Returns:
        A sheet with all panels, which a notebook shows and `write` puts into a file.

    Raises:
        InputError: The grasp does not lie on the body, or the friction is out of range.
    """
    return beside(wrench_panels(body, grasp, friction, view=view))


def wrench_panels(
    body: Polyhedron, grasp: Grasp, friction: float, *, view: View | None = None
) -> tuple[Sheet, Sheet, Sheet]:
    """Draw the panels of `wrench_figure` as sheets of their own."""
    check_drawn(body, grasp, friction, view)
    view = view or best_view(body, grasp)
    quality = ferrari_canny(
        grasp, friction=friction, center=body.center_of_mass, torque_scale=body.radius
    )
    wrenches, radius = quality.wrenches, quality.upper
    right, up = view.axes[0], view.axes[1]
    still = np.zeros(3)
    closed = "weakest direction" if radius > 0.0 else "not in force closure: zero is outside"
    scale = f"torques over {1e3 * body.radius:.3g} mm"
    aside, above = "to the right of the picture [N]", "up [N]"
    return (
        _shadow(wrenches, _weakest_plane(wrenches, quality.direction), radius, facet=True, names=(
            closed, f"along it [N], quality {radius:.3g}", "across it [N]")),
        _shadow(wrenches, np.array([[*right, *still], [*up, *still]]), radius, names=(
            "forces", aside, above)),
        _shadow(wrenches, np.array([[*still, *right], [*still, *up]]), radius, names=(
            scale, aside, above)),
    )  # fmt: skip


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

    Takes `plane` (2, 6). Gives points of the border, (TURNS, 2), counter-clockwise.
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


def _shadow(
    wrenches: WrenchSet, plane: Array, radius: float, *, names: tuple[str, str, str],
    facet: bool = False,
) -> Sheet:  # fmt: skip
    border = shadow_of(wrenches, plane)
    ball = max(radius, 0.0)
    points = np.vstack([border, [[0.0, 0.0], [ball, ball], [-ball, -ball]]])
    low, high = points.min(axis=0), points.max(axis=0)
    middle = 0.5 * (low + high)
    half = max(AROUND * float((high - low).max()), SMALLEST_NORMAL)
    x, y = (Scale(float(each - half), float(each + half)) for each in middle)
    panel = Panel(PLACE[0], PLACE[1], PLACE[2], PLACE[2], x, y)
    disc = circle(np.zeros(2), ball)
    marks: list[Mark] = [*panel.frame(*(
        [(tick, f"{tick:g}") for tick in ticks_in(scale.low, scale.high)] for scale in (x, y)
    ))]  # fmt: skip
    area = thinned(panel.at(*border.T))
    marks += [Area((area,), GOOD, 0.25), outlined([area], GOOD), *_hatched(panel, ball)]
    marks += [outlined([panel.at(*disc.T)], INK, 1.2)]
    marks += [panel.upright(radius, BAD)] if facet else []
    center = panel.at(np.zeros(1), np.zeros(1))
    marks.append(Line(tuple(center + 4.0 * np.array(arm) for arm in CROSS), INK, 1.4))
    entries = [Entry("can be applied", GOOD, "area"), Entry("largest ball", INK)]
    entries += [Entry("limiting facet", BAD)] if facet else []
    key, _ = keyed(entries, 8.0, HEIGHT - 2.0 * ROW, WIDTH - 8.0)
    return Sheet(WIDTH, HEIGHT, names[0], (*marks, *panel.named(*names), *key))


def _hatched(panel: Panel, radius: float) -> list[Mark]:
    heights = radius * np.linspace(-1.0, 1.0, HATCHES + 2)[1:-1]
    long = np.sqrt(np.maximum(radius**2 - heights**2, 0.0))
    ends = np.stack([
        np.stack([end - heights, end + heights], axis=1) for end in (-long, long)
    ], axis=1) / math.sqrt(2.0)  # fmt: skip
    return [Line(tuple(panel.at(*line.T) for line in ends), INK, 0.7)] if radius else []
