"""Draws how much a grasp resists in every direction: forces and torques on maps of the sphere.

The maps use Hammer's projection, which keeps areas; +x is in the middle and -x at the rim.
"""

import math
from typing import Any

import numpy as np

from grasp_core.arrays import Array
from grasp_core.checked import positive
from grasp_core.closure.force_closure import force_closure
from grasp_core.errors import InputError
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.quality.wrench_limits import wrench_limits
from grasp_core.values import Grasp
from scenes.drawing.canvas import Around, entitle, figure_with_panels, in_style
from scenes.drawing.palette import BAD, INK, NEUTRAL
from scenes.drawing.pictures import check_drawn
from scenes.fingertips import FingerSettings

LONGITUDES, LATITUDES = 21, 11
"""Numbers of a map's nodes: around, where the first is also the last, and from pole to pole."""
COLOURS = "cividis"
"""Name of the colour map from small to large values; its colours differ in brightness, too."""
WIDTHS = (1.0, 0.03, 1.0, 0.03)
"""Relative widths of the two maps, each with the scale of its colours."""
MILLI = 1e3
USUAL_PUSH_N = FingerSettings().max_normal_force_n
SAME = 12
"""Number of decimals to which two directions must agree to count as equal."""
NAMED = {
    "+x": (0.0, 0.0), "+y": (90.0, 0.0), "-y": (-90.0, 0.0), "+z": (0.0, 80.0), "-z": (0.0, -80.0),
    "-x": (172.0, 0.0),
}  # fmt: skip
"""Longitudes and latitudes of the labels that name directions on a map [deg]; the labels of z are a
little off the poles."""


@in_style
def margin_figure(
    body: Polyhedron, grasp: Grasp, friction: float, *, max_normal_force_n: float = USUAL_PUSH_N
) -> Any:
    """Draw the largest force and torque that a grasp resists in every direction.

    Args:
        body: The object.
        grasp: A grasp on the faces of `body`, in force closure.
        friction: Coulomb coefficient.
        max_normal_force_n: Largest normal force of each finger [N].

    Returns:
        A matplotlib figure.

    Raises:
        InputError: The grasp does not lie on the body, or is not in force closure at this friction.
    """
    check_drawn(body, grasp, friction, None)
    positive(max_normal_force_n, "max_normal_force_n")
    if not force_closure(grasp, friction=friction).closed:
        raise InputError(
            f"{grasp.id} is not in force closure at friction {friction:g}, so it resists nothing "
            f"in some direction; draw it at a friction above {grasp.critical_friction:.4g}"
        )
    around = Around(left=0.01, right=0.05, below=0.02, above=0.12, between=0.12)
    figure, places = figure_with_panels(9.0, 2.5, 4, around=around, widths=WIDTHS)
    forces, force_scale, torques, torque_scale = places
    ways = np.zeros((LATITUDES * LONGITUDES, 6))
    ways[:, :3] = directions_of_map().reshape(-1, 3)
    limits = _limits(body, grasp, friction, max_normal_force_n, ways)
    _map(forces, force_scale, limits, "largest force resisted [N]")
    ways = np.roll(ways, 3, axis=1) * body.radius
    limits = MILLI * body.radius * _limits(body, grasp, friction, max_normal_force_n, ways)
    _map(torques, torque_scale, limits, "largest torque resisted [mN m]")
    return figure


def _limits(
    body: Polyhedron, grasp: Grasp, friction: float, largest: float, wrenches: Array
) -> Array:
    """Compute how far each wrench of a map is resisted, (LATITUDES, LONGITUDES)."""
    different, same = np.unique(np.round(wrenches, SAME), axis=0, return_inverse=True)
    found = wrench_limits(
        grasp, None, friction, different, max_normal_force=largest, center=body.center_of_mass
    )
    limits = np.array([each.limit for each in found])
    return limits[same.reshape(-1)].reshape(LATITUDES, LONGITUDES)


def _nodes() -> tuple[Array, Array]:
    """Return longitudes and latitudes of a map's nodes, (LATITUDES, LONGITUDES) each [rad]."""
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


def _map(axes: Any, scale: Any, values: Array, title: str) -> None:
    """Draw a map into axes, and its colours beside it."""
    x, y = on_map(*_nodes())
    axes.pcolormesh(x, y, values, cmap=COLOURS, shading="gouraud")
    least = int(values.argmin())
    axes.plot(
        x.flat[least],
        y.flat[least],
        "o",
        mfc="none",
        mec=BAD,
        ms=9,
        mew=2.5,
        clip_on=False,
        zorder=11,
    )
    for name, angles in NAMED.items():
        place = on_map(*(np.array(math.radians(angle)) for angle in angles))
        axes.text(*map(float, place), name, ha="center", va="center", fontsize=8.0, color="white",
                  bbox={"boxstyle": "round,pad=0.15", "fc": INK, "ec": "none", "alpha": 0.6}
        )  # fmt: skip
    axes.set_aspect("equal")
    axes.set_axis_off()
    entitle(axes, f"{title}: least {values.min():.3g} (circle)")
    heights = np.array([values.min(), max(values.max(), np.nextafter(values.min(), np.inf))])
    scale.pcolormesh(
        np.array([0.0, 1.0]), heights, np.repeat(heights[:, None], 2, axis=1), cmap=COLOURS,
        shading="gouraud",
    )  # fmt: skip
    scale.set_xticks([])
    scale.yaxis.tick_right()
    scale.set_ylim(*heights)
    for spine in scale.spines.values():
        spine.set(visible=True, edgecolor=NEUTRAL)
