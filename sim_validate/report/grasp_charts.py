"""Charts of what a grasp resists: maps of the largest wrenches, and shadows of all of them.

The maps show how large a force or torque the grasp resists in every direction. They use Hammer's
projection, which keeps areas; +x is in the middle and -x at the rim.

The set W of wrenches that contact forces with normal parts of sum 1 N can apply is convex, and its
farthest point along any direction is known. So its projection onto any plane can be drawn exactly:
it is bounded by the points of W farthest along each direction of the plane. The largest ball in W
around zero, whose radius is the Ferrari-Canny quality, is projected to a disc. The ball touches the
border of W in its weakest direction; in a plane that holds this direction, the limiting facet is a
line that touches the disc and the projection.
"""

import math
from collections.abc import Iterator

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.closure.force_closure import force_closure
from grasp_core.closure.wrench_sets import WrenchSet
from grasp_core.errors import InputError
from grasp_core.kinds import Quantity, value_of
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.quality.ferrari_canny import ferrari_canny
from grasp_core.quality.wrench_limits import wrench_limits
from grasp_core.values import Grasp
from scenes.drawing.drawings import check_drawn
from scenes.drawing.panels import SMALL, Entry, Panel, Scale, thinned, ticks_in
from scenes.drawing.sheets import (
    BAD,
    GOOD,
    INK,
    LEVELS,
    NEUTRAL,
    PAPER,
    Area,
    Image,
    Line,
    Mark,
    Sheet,
    Words,
    beside,
    circle,
    ink_line,
    levels_of,
    outlined,
)
from scenes.drawing.views import View, best_view
from scenes.settings import FingerSettings

LONGITUDES, LATITUDES = 21, 11
"""Numbers of a map's nodes: around, where the first is also the last, and from pole to pole."""
WIDTH, HEIGHT = 440.0, 300.0
EDGE = 12.0
"""Width of the margins beside the scale of colours [pixels]."""
MIDDLE, HALF = np.array([220.0, 130.0]), 100.0
"""Middle of a map on its panel, and half of its height [pixels]."""
APART = 0.15
"""Least distance of a number below the scale from its ends, as a share of its length."""
BOX = np.array([(-12.0, -8.0), (12.0, -8.0), (12.0, 8.0), (-12.0, 8.0)])
"""Ground of the name of a direction, around its middle [pixels]."""
LABEL = 18.0
"""Distance from the circle of the least value within which a label gives way [pixels]."""
ROWS = 60
"""Height of the image of a map [its own pixels]; the map is twice as wide."""
MILLI = 1e3
USUAL_PUSH_N = FingerSettings().max_normal_force_n
SAME = 12
"""Number of decimals to which two directions must agree to count as equal."""
NAMED = {
    "+x": (0.0, 0.0), "+y": (90.0, 0.0), "-y": (-90.0, 0.0), "+z": (0.0, 80.0), "-z": (0.0, -80.0),
    "-x": (172.0, 0.0),
}  # fmt: skip
SHADOW_SIZE = 300.0, 338.0
"""Width and height of a panel [pixels]."""
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


def margin_figure(
    body: Polyhedron, grasp: Grasp, friction: float, *, max_normal_force_n: float = USUAL_PUSH_N
) -> Sheet:
    """Draw the largest force and torque that a grasp resists in every direction.

    Args:
        body: The object.
        grasp: A grasp on the faces of `body`, in force closure.
        friction: Coulomb coefficient.
        max_normal_force_n: Largest normal force of each finger [N].

    Returns:
        A sheet with all panels, which a notebook shows and `write` puts into a file.

    Raises:
        InputError: The grasp does not lie on the body, or is not in force closure at this friction.
    """
    panels = margin_panels(body, grasp, friction, max_normal_force_n=max_normal_force_n)
    return beside(panels)


def margin_panels(
    body: Polyhedron, grasp: Grasp, friction: float, *, max_normal_force_n: float = USUAL_PUSH_N
) -> tuple[Sheet, Sheet]:
    """Draw the panels of `margin_figure` as sheets of their own."""
    forces, torques = margins(body, grasp, friction, max_normal_force_n=max_normal_force_n)
    return _map(forces, "force", "N"), _map(torques, "torque", "mN m")


def margins(
    body: Polyhedron, grasp: Grasp, friction: float, *, max_normal_force_n: float = USUAL_PUSH_N
) -> tuple[Array, Array]:
    """Compute the largest force [N] and torque [mN m] resisted, (LATITUDES, LONGITUDES) each."""
    check_drawn(body, grasp, friction)
    value_of(Quantity, max_normal_force_n, "max_normal_force_n")
    certificate = force_closure(grasp, friction=friction)
    if certificate.forces is None:
        raise InputError(
            f"{grasp.id} is not in force closure at friction {friction:g}, so it resists nothing "
            f"in some direction; draw it at a friction above {grasp.critical_friction:.4g}"
        )
    ways = np.zeros((LATITUDES * LONGITUDES, 6))
    ways[:, :3] = directions_of_map().reshape(-1, 3)
    forces = _limits(body, grasp, friction, max_normal_force_n, ways)
    ways = np.roll(ways, 3, axis=1) * body.radius
    torques = _limits(body, grasp, friction, max_normal_force_n, ways)
    return forces, MILLI * body.radius * torques


def _limits(
    body: Polyhedron, grasp: Grasp, friction: float, largest: float, wrenches: Array
) -> Array:
    different, same = np.unique(np.round(wrenches, SAME), axis=0, return_inverse=True)
    found = wrench_limits(
        grasp, None, friction, different, max_normal_force=largest, center=body.center_of_mass
    )
    limits = np.array([each.limit for each in found])
    return limits[same.reshape(-1)].reshape(LATITUDES, LONGITUDES)


def _nodes() -> tuple[Array, Array]:
    around = np.linspace(-np.pi, np.pi, LONGITUDES)
    longitudes, latitudes = np.meshgrid(around, np.linspace(-0.5 * np.pi, 0.5 * np.pi, LATITUDES))
    return longitudes, latitudes


def directions_of_map() -> Array:
    """Return unit vectors to a map's nodes, (LATITUDES, LONGITUDES, 3)."""
    longitudes, latitudes = _nodes()
    flat = np.cos(latitudes)
    return np.stack(
        [flat * np.cos(longitudes), flat * np.sin(longitudes), np.sin(latitudes)], axis=2
    )


def on_map(longitudes: Array, latitudes: Array) -> tuple[Array, Array]:
    """Project directions [rad] onto a map, whose sides are at +-2 and whose poles are at +-1."""
    scale = np.sqrt(1.0 + np.cos(latitudes) * np.cos(0.5 * longitudes))
    return 2.0 * np.cos(latitudes) * np.sin(0.5 * longitudes) / scale, np.sin(latitudes) / scale


def _map(values: Array, kind: str, unit: str) -> Sheet:
    low, high = float(values.min()), float(values.max())
    title = f"largest {kind} resisted [{unit}]"
    rim = MIDDLE + HALF * circle(np.zeros(2), 1.0) * np.array([2.0, 1.0])
    marks: list[Mark] = [
        Words(8.0, 14.0, title, bold=True),
        Image(MIDDLE[0] - 2.0 * HALF, MIDDLE[1] - HALF, 4.0 * HALF, 2.0 * HALF,
              pixels(values, low, high)),
        outlined([rim], NEUTRAL, 2.5),
    ]  # fmt: skip
    row, column = np.unravel_index(int(values.argmin()), values.shape)
    least = MIDDLE + HALF * np.array([1.0, -1.0]) * [
        part[row, column] for part in on_map(*_nodes())
    ]
    for name, angles in NAMED.items():
        place = np.array(on_map(*(np.array(math.radians(angle)) for angle in angles)))
        middle = MIDDLE + HALF * place * np.array([1.0, -1.0])
        aside = np.array([0.0, LABEL if np.hypot(*(middle - least)) < LABEL else 0.0])
        middle = middle + aside
        x, y = middle.tolist()
        marks += [Area((BOX + middle,), PAPER, 0.85), Words(x, y, name, "middle", SMALL)]
    marks += [outlined([circle(least, 6.0)], PAPER, 5.0), outlined([circle(least, 6.0)], BAD, 2.5)]
    return Sheet(WIDTH, HEIGHT, title, (*marks, *_scale(low, high)))


def _scale(low: float, high: float) -> Iterator[Mark]:
    """Draw the colours of a map from its least to its largest value, and what its circle marks."""
    top, long = MIDDLE[1] + HALF + 12.0, WIDTH - 2.0 * EDGE
    yield Image(EDGE, top, long, 10.0, np.arange(LEVELS)[None])
    ends = f"{low:.3g}", f"{high:.3g}"
    yield Words(EDGE, top + 20.0, ends[0], "start", SMALL)
    yield Words(WIDTH - EDGE, top + 20.0, ends[1], "end", SMALL)
    inside = [tick for tick in ticks_in(low, high) if low < tick < high] if high > low else []
    between = [
        tick for tick in inside if APART < (tick - low) / (high - low) < 1.0 - APART
    ]  # fmt: skip
    for tick in between:
        x = EDGE + long * (tick - low) / (high - low)
        yield ink_line([(x, top + 10.0), (x, top + 13.0)])
        yield Words(x, top + 20.0, f"{tick:g}", "middle", SMALL)
    y = top + 40.0
    yield outlined([circle(np.array([EDGE + 6.0, y]), 5.0)], BAD, 2.5)
    yield Words(EDGE + 18.0, y, f"least: {low:.3g}", size=SMALL)


def pixels(values: Array, low: float, high: float) -> Indices:
    """Find the level of each pixel of a map, from the top, (ROWS, 2 ROWS); -1 outside of it."""
    up, right = np.meshgrid(
        1.0 - (2.0 * np.arange(ROWS) + 1.0) / ROWS,
        2.0 * ((2.0 * np.arange(2 * ROWS) + 1.0) / (2 * ROWS) - 1.0), indexing="ij",
    )  # fmt: skip
    inside = 0.25 * right**2 + up**2 < 1.0
    # the inverse of `on_map`, with x and y in the common parametrisation by a half-angle
    x, y = 0.5 * right * math.sqrt(0.5), up * math.sqrt(0.5)
    z = np.sqrt(np.maximum(1.0 - x**2 - y**2, 0.5))
    longitude = 2.0 * np.arctan2(2.0 * z * x, 2.0 * z**2 - 1.0)
    latitude = np.arcsin(np.clip(2.0 * z * y, -1.0, 1.0))
    columns = (longitude / (2.0 * np.pi) + 0.5) * (LONGITUDES - 1)
    rows = (latitude / np.pi + 0.5) * (LATITUDES - 1)
    return np.where(inside, levels_of(_between(values, rows, columns), low, high), -1)


def _between(values: Array, rows: Array, columns: Array) -> Array:
    i = np.clip(rows.astype(int), 0, LATITUDES - 2)
    j = np.clip(columns.astype(int), 0, LONGITUDES - 2)
    a, b = np.clip(rows - i, 0.0, 1.0), np.clip(columns - j, 0.0, 1.0)
    south = (1.0 - b) * values[i, j] + b * values[i, j + 1]
    north = (1.0 - b) * values[i + 1, j] + b * values[i + 1, j + 1]
    return (1.0 - a) * south + a * north


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
    """Compute the border of an `l1` wrench set's projection onto a plane (2, 6), (TURNS, 2).

    Each point of it is the wrench of one contact alone, whose force is at the rim of its cone.
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
    marks = [*panel.frame(ticks_in(x.low, x.high), ticks_in(y.low, y.high))]
    area = thinned(panel.at(*border.T))
    marks += [Area((area,), GOOD, 0.25), outlined([area], GOOD), *_hatched(panel, ball)]
    marks += [outlined([panel.at(*disc.T)], INK, 1.2)]
    marks += [panel.upright(radius, BAD)] if facet else []
    center = panel.at(np.zeros(1), np.zeros(1))
    marks.append(Line(tuple(center + 4.0 * np.array(arm) for arm in CROSS), INK, 1.4))
    entries = [Entry("can be applied", GOOD, "area"), Entry("largest ball", INK)]
    entries += [Entry("limiting facet", BAD)] if facet else []
    return panel.sheet(SHADOW_SIZE, names, marks, entries)


def _hatched(panel: Panel, radius: float) -> list[Mark]:
    heights = radius * np.linspace(-1.0, 1.0, HATCHES + 2)[1:-1]
    long = np.sqrt(np.maximum(radius**2 - heights**2, 0.0))
    ends = np.stack([
        np.stack([end - heights, end + heights], axis=1) for end in (-long, long)
    ], axis=1) / math.sqrt(2.0)  # fmt: skip
    return [Line(tuple(panel.at(*line.T) for line in ends), INK, 0.7)] if radius else []
