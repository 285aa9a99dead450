"""Draws charts: what a grasp resists, how a trial went, and simulated over predicted values.

The maps show how large a force or torque the grasp resists in every direction. They use Hammer's
projection, which keeps areas; +x is in the middle and -x at the rim.

The set W of wrenches that contact forces with normal parts of sum 1 N can apply is convex, and its
farthest point along any direction is known. So its projection onto any plane can be drawn exactly:
it is bounded by the points of W farthest along each direction of the plane. The largest ball in W
around zero, whose radius is the Ferrari-Canny quality, is projected to a disc. The ball touches the
border of W in its weakest direction; in a plane that holds this direction, the limiting facet is a
line that touches the disc and the projection.

A trial's charts show how far object and fingers moved, and how hard fingers pushed. Points of
simulated over predicted values should lie on the line of equal values. A trial that was predicted
to hold and did not, or the reverse, contradicts the analysis or the simulation. As in `validate`,
neither is counted for loads within `AGREEMENT` of their limit and for trials that prove nothing,
such as those that diverged.
"""

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from grasp_core.allowed_values import Quantity, instance, value_of
from grasp_core.arrays import Array, Indices
from grasp_core.closure.force_closure import force_closure
from grasp_core.closure.wrench_sets import WrenchSet
from grasp_core.errors import InputError
from grasp_core.messages import MICRO, MILLI
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.quality.ferrari_canny import ferrari_canny
from grasp_core.quality.limit_bounds import limit_bounds
from grasp_core.quality.wrench_limits import WrenchBody, body_of, limit_of
from grasp_core.values import Grasp
from scenes.drawing.painting import Camera
from scenes.drawing.panels import ROW, SMALL_TYPE, Axis, KeyLine, Panel, marker, thinned
from scenes.drawing.pictures import Drawing
from scenes.drawing.sheets import (
    BAD_HEX,
    FINGER_COLOURS,
    GOOD_HEX,
    INK_HEX,
    LEVELS,
    NEUTRAL,
    PAPER,
    Area,
    Dots,
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
from scenes.settings import FingerSettings
from sim_validate.closure.controls import ControlTrial
from sim_validate.closure.replaying import Replayed
from sim_validate.closure.verdict import AGREEMENT, Verdict, WrenchVerdict
from sim_validate.engine.held_or_let_go import LET_GO, Outcome

LONGITUDES, LATITUDES = 21, 11
"""Numbers of a map's nodes: around, where the first is also the last, and from pole to pole."""
MAP_GAP = 1e-3
"""Largest error of a map's nodes, as a share of them; its levels are farther apart."""
CHART_WIDTH, CHART_HEIGHT = 440.0, 300.0
SCALE_MARGIN = 12.0
MIDDLE, MAP_HALF = np.array([220.0, 130.0]), 100.0
"""Middle of a map on its panel, and half of its height [pixels]."""
NUMBERS_APART = 0.15
"""Least distance of a number below the scale from its ends, as a share of its length."""
NAME_GROUND = np.array([(-12.0, -8.0), (12.0, -8.0), (12.0, 8.0), (-12.0, 8.0)])
"""Ground of the name of a direction, around its middle [pixels]."""
LABEL = 18.0
MAP_ROWS = 60
"""Height of the image of a map [its own pixels]; the map is twice as wide."""
USUAL_PUSH_N = FingerSettings().max_normal_force_n
DIRECTION_DECIMALS = 12
"""Number of decimals to which two directions must agree to count as equal."""
MAP_DIRECTIONS = {
    "+x": (0.0, 0.0), "+y": (90.0, 0.0), "-y": (-90.0, 0.0), "+z": (0.0, 80.0), "-z": (0.0, -80.0),
    "-x": (172.0, 0.0),
}  # fmt: skip
SHADOW_SIZE = 300.0, 338.0
PLACE = (62.0, 28.0, 224.0)
"""Left and upper border of the square in which a panel draws, and its side [pixels]."""
AROUND = 0.55
"""Half of the range of an axis, relative to the extent of what is drawn."""
HATCHES = 7
CROSS = (((-1.0, 0.0), (1.0, 0.0)), ((0.0, -1.0), (0.0, 1.0)))
SHADOW_ENDS = 181
LEAST_DIVISOR = np.finfo(np.float64).tiny
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
    return beside(margin_panels(Drawing(body, grasp, friction), max_normal_force_n))


def margin_panels(drawing: Drawing, max_normal_force_n: float) -> tuple[Sheet, Sheet]:
    """Draw the panels of `margin_figure` as sheets of their own."""
    forces, torques = margins(drawing, max_normal_force_n)
    return _map(forces, "force", "N"), _map(torques, "torque", "mN m")


def margins(drawing: Drawing, max_normal_force_n: float) -> tuple[Array, Array]:
    """Compute the largest force [N] and torque [mN m] resisted, (LATITUDES, LONGITUDES) each."""
    grasp, friction, body = drawing.grasp, drawing.friction, drawing.body
    largest = value_of(Quantity, max_normal_force_n, "max_normal_force_n")
    closure = force_closure(grasp, friction=friction)
    if closure.forces is None:
        raise InputError(
            f"{grasp.id} is not in force closure at friction {friction:g}, so it resists nothing "
            f"in some direction; draw it at a friction above {grasp.critical_friction:.4g}"
        )
    ways, still = directions_of_map().reshape(-1, 3), np.zeros((LATITUDES * LONGITUDES, 3))
    wrenches = np.vstack([np.hstack([ways, still]), np.hstack([still, body.radius * ways])])
    different, same = np.unique(np.round(wrenches, DIRECTION_DECIMALS), axis=0, return_inverse=True)
    arms = grasp.positions - body.center_of_mass
    resisted = body_of(arms, grasp.normals, friction, largest, None, 0.0)
    limits = _limits(resisted, resisted.in_frames(closure.forces, None), different)
    forces, torques = limits[same].reshape(2, LATITUDES, LONGITUDES)
    return forces, MILLI * body.radius * torques


def _limits(resisted: WrenchBody, balanced: Array, wrenches: Array) -> Array:
    """Find multiples of wrenches (n, 6) that are resisted, up to a share `MAP_GAP` of the most."""
    loads = resisted.about_middle(wrenches)
    bounds = limit_bounds(resisted.bounded, balanced, loads, MAP_GAP)
    limits, upper = resisted.max_normal_force * bounds.T
    # the program itself where the bounds did not come together
    for place in np.flatnonzero(~(upper - limits <= MAP_GAP * limits)):
        limits[place] = limit_of(resisted, wrenches[place]).limit
    return limits


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
    rim = MIDDLE + MAP_HALF * circle(np.zeros(2), 1.0) * np.array([2.0, 1.0])
    marks: list[Mark] = [
        Words(8.0, 14.0, title, bold=True),
        Image(MIDDLE[0] - 2.0 * MAP_HALF, MIDDLE[1] - MAP_HALF, 4.0 * MAP_HALF, 2.0 * MAP_HALF,
              pixels(values, low, high)),
        outlined([rim], NEUTRAL, 2.5),
    ]  # fmt: skip
    row, column = np.unravel_index(int(values.argmin()), values.shape)
    least = MIDDLE + MAP_HALF * np.array([1.0, -1.0]) * [
        part[row, column] for part in on_map(*_nodes())
    ]
    for name, angles in MAP_DIRECTIONS.items():
        place = np.array(on_map(*(np.array(math.radians(angle)) for angle in angles)))
        middle = MIDDLE + MAP_HALF * place * np.array([1.0, -1.0])
        aside = np.array([0.0, LABEL if np.hypot(*(middle - least)) < LABEL else 0.0])
        middle = middle + aside
        x, y = middle.tolist()
        marks += [
            Area((NAME_GROUND + middle,), PAPER, 0.85),
            Words(x, y, name, "middle", SMALL_TYPE),
        ]
    marks += [
        outlined([circle(least, 6.0)], PAPER, 5.0),
        outlined([circle(least, 6.0)], BAD_HEX, 2.5),
    ]
    return Sheet(CHART_WIDTH, CHART_HEIGHT, title, (*marks, *_scale(low, high)))


def _scale(low: float, high: float) -> Iterator[Mark]:
    top, long = MIDDLE[1] + MAP_HALF + 12.0, CHART_WIDTH - 2.0 * SCALE_MARGIN
    yield Image(SCALE_MARGIN, top, long, 10.0, np.arange(LEVELS)[None])
    ends = f"{low:.3g}", f"{high:.3g}"
    yield Words(SCALE_MARGIN, top + 20.0, ends[0], "start", SMALL_TYPE)
    yield Words(CHART_WIDTH - SCALE_MARGIN, top + 20.0, ends[1], "end", SMALL_TYPE)
    for tick in Axis(low, high).ticks() if high > low else ():
        share = (tick - low) / (high - low)
        if NUMBERS_APART < share < 1.0 - NUMBERS_APART:
            x = SCALE_MARGIN + long * share
            yield ink_line([(x, top + 10.0), (x, top + 13.0)])
            yield Words(x, top + 20.0, f"{tick:g}", "middle", SMALL_TYPE)
    y = top + 40.0
    yield outlined([circle(np.array([SCALE_MARGIN + 6.0, y]), 5.0)], BAD_HEX, 2.5)
    yield Words(SCALE_MARGIN + 18.0, y, f"least: {low:.3g}", size=SMALL_TYPE)


def pixels(values: Array, low: float, high: float) -> Indices:
    """Find the level of each pixel of a map, from the top; -1 outside of it."""
    up, right = np.meshgrid(
        1.0 - (2.0 * np.arange(MAP_ROWS) + 1.0) / MAP_ROWS,
        2.0 * ((2.0 * np.arange(2 * MAP_ROWS) + 1.0) / (2 * MAP_ROWS) - 1.0), indexing="ij",
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
    body: Polyhedron, grasp: Grasp, friction: float, *, view: Camera | None = None
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
    return beside(wrench_panels(Drawing(body, grasp, friction), view))


def wrench_panels(drawing: Drawing, view: Camera | None = None) -> tuple[Sheet, Sheet, Sheet]:
    """Draw the panels of `wrench_figure` as sheets of their own."""
    if view is not None:
        instance(view, Camera, "view", "Camera.of_angles makes one")
    body, (right, up, _) = drawing.body, (view or drawing.view()).axes
    quality = ferrari_canny(
        drawing.grasp, friction=drawing.friction, center=body.center_of_mass,
        torque_scale=body.radius,
    )  # fmt: skip
    wrenches, radius = quality.wrenches, quality.upper
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
    """Compute the border of an `l1` wrench set's projection onto a plane (2, 6), (SHADOW_ENDS, 2).

    Each point of it is the wrench of one contact alone, whose force is at the rim of its cone.
    """
    angles = np.linspace(0.0, 2.0 * np.pi, SHADOW_ENDS)
    ways = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    slopes = (ways @ plane @ wrenches.G).reshape(SHADOW_ENDS, -1, 3)
    across = np.hypot(slopes[..., 1], slopes[..., 2])
    farthest = np.argmax(slopes[..., 0] + wrenches.friction * across, axis=1)
    rows = np.arange(SHADOW_ENDS)
    forces = np.zeros_like(slopes)
    forces[rows, farthest, 0] = 1.0
    sliding = wrenches.friction[farthest] / np.maximum(across[rows, farthest], LEAST_DIVISOR)
    forces[rows, farthest, 1:] = slopes[rows, farthest, 1:] * sliding[:, None]
    return forces.reshape(SHADOW_ENDS, -1) @ (plane @ wrenches.G).T


def _shadow(
    wrenches: WrenchSet, plane: Array, radius: float, *, names: tuple[str, str, str],
    facet: bool = False,
) -> Sheet:  # fmt: skip
    border = shadow_of(wrenches, plane)
    ball = max(radius, 0.0)
    points = np.vstack([border, [[0.0, 0.0], [ball, ball], [-ball, -ball]]])
    low, high = points.min(axis=0), points.max(axis=0)
    middle = 0.5 * (low + high)
    half = max(AROUND * float((high - low).max()), LEAST_DIVISOR)
    x, y = (Axis(float(each - half), float(each + half)) for each in middle)
    panel = Panel(PLACE[0], PLACE[1], PLACE[2], PLACE[2], x, y)
    disc = circle(np.zeros(2), ball)
    marks = [*panel.frame(x.ticks(), y.ticks())]
    area = thinned(panel.at(*border.T))
    marks += [Area((area,), GOOD_HEX, 0.25), outlined([area], GOOD_HEX), *_hatched(panel, ball)]
    marks += [outlined([panel.at(*disc.T)], INK_HEX, 1.2)]
    marks += [panel.upright(radius, BAD_HEX)] if facet else []
    center = panel.at(np.zeros(1), np.zeros(1))
    marks.append(Line(tuple(center + 4.0 * np.array(arm) for arm in CROSS), INK_HEX, 1.4))
    entries = [KeyLine("can be applied", GOOD_HEX, "area"), KeyLine("largest ball", INK_HEX)]
    entries += [KeyLine("limiting facet", BAD_HEX)] if facet else []
    return panel.sheet(SHADOW_SIZE, names, marks, entries)


def _hatched(panel: Panel, radius: float) -> list[Mark]:
    heights = radius * np.linspace(-1.0, 1.0, HATCHES + 2)[1:-1]
    long = np.sqrt(np.maximum(radius**2 - heights**2, 0.0))
    ends = np.stack([
        np.stack([end - heights, end + heights], axis=1) for end in (-long, long)
    ], axis=1) / math.sqrt(2.0)  # fmt: skip
    return [Line(tuple(panel.at(*line.T) for line in ends), INK_HEX, 0.7)] if radius else []


MOTION_SIZE = 300.0, 316.0
TIME = "time since friction was lowered [s]"
MOTION_PLACE = (50.0, 28.0, 236.0, 180.0)
KEY = 3.0 * ROW + 6.0
SLIP_NAME = (1.0, "slips")
"""Share of its friction that a finger uses when it slips, and its name."""
MOST_SHARE = 1.15
"""Upper end of an axis, relative to the limit on it."""
LEAST_UM = 1e-4
"""Displacement at which the chart's logarithmic axis begins [um]."""
LEAST_PUSH = 1e-3
"""Share of a finger's largest push below which its use of friction is not shown."""
PAIRS_SIZE = 360.0, 388.0
PAIRS_PLACE = (70.0, 28.0, 280.0, 280.0)
LEAST_SHOWN = 0.5
"""Place of zero on a logarithmic axis, relative to the least value above zero."""


def motion_panels(found: Replayed, threshold_m: float) -> tuple[Sheet, Sheet, Sheet]:
    """Draw displacement, normal forces and use of friction over the time of one trial."""
    watched = found.watched
    share = friction_used(watched.pushes_n, watched.friction)
    return (
        _moved(found, threshold_m),
        _of_fingers("normal force [N]", watched.times_s, watched.pushes_n[..., 0], None),
        _of_fingers("share of friction used", watched.times_s, share, SLIP_NAME),
    )


def _moved(found: Replayed, threshold_m: float) -> Sheet:
    trace = found.watched.trace
    finite = trace.displacements_m[np.isfinite(trace.displacements_m)]
    highest = 2.0 * MICRO * max(threshold_m, float(finite.max(initial=0.0)))
    panel = _panel(trace.times_s, Axis(LEAST_UM, highest, log=True))
    steps = 10.0 ** np.arange(-4, math.log10(highest), 2)
    slips = list(zip(FINGER_COLOURS, trace.slips_m.T, strict=False))
    marks = [
        *panel.frame(panel.x.ticks(4), steps.tolist()),
        *(panel.curve(trace.times_s, MICRO * slip, colour) for colour, slip in slips),
        panel.curve(trace.times_s, MICRO * trace.displacements_m, INK_HEX, 1.8),
        panel.level(MICRO * threshold_m, BAD_HEX),
    ]
    key = [
        KeyLine("object", INK_HEX), KeyLine("counts as moved", BAD_HEX, "dashes"),
        *(KeyLine(f"{place} slid", colour) for place, (colour, _) in enumerate(slips)),
    ]  # fmt: skip
    return panel.sheet(MOTION_SIZE, ("displacement [µm]", TIME, ""), marks, key, key_height=KEY)


def _of_fingers(title: str, times: Array, values: Array, limit: tuple[float, str] | None) -> Sheet:
    finite = values[np.isfinite(values)]
    top = max(1.1 * float(finite.max(initial=0.0)), 1e-9)
    low = min(0.0, float(finite.min(initial=0.0)))
    panel = _panel(times, Axis(low, top if limit is None else MOST_SHARE * limit[0]))
    curves = list(zip(FINGER_COLOURS, values.T, strict=False))
    marks = [
        *panel.frame(panel.x.ticks(4), panel.y.ticks()),
        *(panel.curve(times, np.where(np.isfinite(each), each, np.nan), colour)
          for colour, each in curves),
        panel.upright(0.0, NEUTRAL, dashed=True),
    ]  # fmt: skip
    key = [KeyLine(f"finger {place}", colour) for place, (colour, _) in enumerate(curves)]
    if limit is not None:
        marks.append(panel.level(limit[0], BAD_HEX))
        key.append(KeyLine(limit[1], BAD_HEX, "dashes"))
    return panel.sheet(MOTION_SIZE, (title, TIME, ""), marks, key, key_height=KEY)


def _panel(times: Array, y: Axis) -> Panel:
    low, high = float(times.min(initial=0.0)), float(times.max(initial=0.0))
    return Panel(*MOTION_PLACE, Axis(low, high if high > low else low + 1.0), y)


def friction_used(pushes: Array, friction: Array) -> Array:
    """Compute tangential over normal force, over friction, (n, k); NaN if fingers hardly push."""
    normal = pushes[..., 0]
    tangential = np.hypot(pushes[..., 1], pushes[..., 2])
    pushing = normal > LEAST_PUSH * max(float(normal.max(initial=0.0)), 1e-12)
    safe = np.where(pushing, normal, 1.0) * friction[:, None]
    return np.where(pushing, tangential / safe, np.nan)


@dataclass(frozen=True, slots=True)
class Agreement:
    """Predicted and simulated values of one quantity, such as the critical friction."""

    quantity: str
    pairs: tuple[tuple[float, float], ...]
    below: int = 0
    """Number of grasps that held even at the least friction tried, so no value was found."""

    def differ(self) -> tuple[bool, ...]:
        """Whether each pair differs by more than is allowed."""
        return tuple(abs(two - one) > AGREEMENT * one for one, two in self.pairs)

    @property
    def worst(self) -> float:
        """Largest relative difference between prediction and simulation; 0 without pairs."""
        shares = [abs(two - one) / one if one > 0.0 else math.inf for one, two in self.pairs]
        return max(shares, default=0.0)


def frictions_in(verdicts: Iterable[Verdict]) -> Agreement:
    """Compare critical frictions; a simulated zero means that the least one tried sufficed."""
    found = [verdict.critical_friction for verdict in verdicts]
    measured = [(each.predicted, each.simulated) for each in found if each.simulated is not None]
    pairs = tuple(pair for pair in measured if pair[1])
    return Agreement("critical friction", pairs, len(measured) - len(pairs))


def limits_in(verdicts: Iterable[Verdict]) -> Agreement:
    """Compare the sizes of the largest wrenches that were resisted."""
    pairs = tuple(
        (size * trial.predicted_limit, size * trial.simulated_limit)
        for verdict in verdicts
        for trial in verdict.wrenches
        if trial.simulated_limit is not None and math.isfinite(trial.predicted_limit)
        for size in [wrench_size(verdict, trial)]
    )
    return Agreement("largest wrench [N], torques over grasp size", pairs)


def wrench_size(verdict: Verdict, trial: WrenchVerdict) -> float:
    """Compute the size of a trial's wrench [N], with torques divided by the grasp's size."""
    force, torque = np.reshape(trial.wrench, (2, 3))
    return math.hypot(*force, *(torque / verdict.scale.grasp_size_m))


def quadrants_in(verdicts: Sequence[Verdict]) -> Counter[str]:
    """Count trials of grasps and of negative controls by what was predicted and what happened.

    Nothing resists the loads of a control.
    """
    counts = Counter[str]()
    for verdict in verdicts:
        counts.update(_place(trial, resisted(trial)) for trial in verdict.wrenches)
        for control in verdict.controls:
            counts.update(_place(trial, False) for trial in control.tried)
    return counts


def resisted(trial: WrenchVerdict) -> bool | None:
    """Tell whether a load is predicted to be resisted; None if it is too near its limit."""
    limit = trial.predicted_limit
    return None if abs(limit - 1.0) <= AGREEMENT else limit > 1.0


def as_predicted(trial: WrenchVerdict) -> bool:
    """Tell whether a trial ended as predicted, or in a way that the prediction leaves open."""
    wanted = resisted(trial)
    ends = (Outcome.HELD, *LET_GO) if wanted is None else (Outcome.HELD,) if wanted else LET_GO
    return trial.hold.outcome in ends


def _place(trial: WrenchVerdict | ControlTrial, wanted: bool | None) -> str:
    outcome = trial.hold.outcome
    if wanted is None or outcome not in (Outcome.HELD, *LET_GO):
        return "neither"
    held = "held" if outcome is Outcome.HELD else "let_go"
    return f"{'resisted' if wanted else 'not_resisted'}_{held}"


def fidelity_panel(agreement: Agreement) -> Sheet:
    """Draw simulated over predicted values of a quantity on logarithmic axes."""
    name = f"{agreement.quantity}: simulated over predicted"
    names = agreement.quantity, "predicted", "simulated"
    pairs = np.array(agreement.pairs).reshape(-1, 2)
    if not (pairs > 0.0).any():
        panel = Panel(*PAIRS_PLACE, Axis(0.0, 1.0), Axis(0.0, 1.0))
        left, top, wide, high = PAIRS_PLACE
        nothing = Words(left + 0.5 * wide, top + 0.5 * high, "none measured", "middle")
        return Sheet(*PAIRS_SIZE, name, (*panel.frame([], []), *panel.named(*names), nothing))
    pairs = np.maximum(pairs, LEAST_SHOWN * pairs[pairs > 0.0].min())
    ends = np.array([0.7 * pairs.min(), 1.4 * pairs.max()])
    scale = Axis(float(ends[0]), float(ends[1]), log=True)
    panel = Panel(*PAIRS_PLACE, scale, scale)
    low, high = (1.0 - AGREEMENT) * ends, (1.0 + AGREEMENT) * ends
    band = np.vstack([panel.at(ends, low), panel.at(ends, high)[::-1]])
    marks: list[Mark] = [*panel.frame(scale.ticks(), scale.ticks()), Area((band,), NEUTRAL, 0.3)]
    marks.append(Line((panel.at(ends, ends),), NEUTRAL, 1.0))
    key = [KeyLine("identity", NEUTRAL), KeyLine(f"within {AGREEMENT:.0%}", NEUTRAL, "area")]
    off = np.array(agreement.differ())
    if (~off).any():
        marks.append(Dots(_pairs_on_sheet(panel, pairs[~off]), GOOD_HEX, 3.0))
        key.append(KeyLine(f"{int((~off).sum())} agree", GOOD_HEX, "disc"))
    if off.any():
        marks += [
            marker("cross", place, 5.0, BAD_HEX) for place in _pairs_on_sheet(panel, pairs[off])
        ]
        key.append(KeyLine(f"{int(off.sum())} differ", BAD_HEX, "cross"))
    return panel.sheet(PAIRS_SIZE, names, marks, key, name=name)


def _pairs_on_sheet(panel: Panel, pairs: Array) -> Array:
    """Find where pairs are on the sheet, those within half a pixel of one another once, (k, 2)."""
    return np.unique(np.rint(2.0 * panel.at(*pairs.T)), axis=0) / 2.0
