"""Which wrenches a grasp resists, drawn: shadows of the wrench set, and limits by direction.

The set W of wrenches that contact forces with normal parts of sum 1 N can apply is convex, with a
known support, so that its shadow on any plane is drawn exactly: the point of W farthest along each
direction of the plane. The largest ball in W around zero, whose radius is the Ferrari-Canny
quality, casts a disc. It touches W where its support is least; in a plane that holds this
direction, the limiting facet is a line that touches disc and shadow.
"""

from typing import Any

import numpy as np

from grasp_core.arrays import Array
from grasp_core.quality import ferrari_canny
from grasp_core.resisted_wrenches import wrench_limits
from grasp_core.values import Grasp, Polyhedron
from grasp_core.wrench_sets import WrenchSet
from scenes.canvas import Around, entitle, new_figure, panels
from scenes.palette import BAD, GOOD, INK, NEUTRAL
from scenes.views import View, best_view

TURNS = 181
"""Points on the border of a shadow, the first also the last."""
LONGITUDES, LATITUDES = 21, 11
"""Directions of a map, from pole to pole and around, first and last the same."""
TINY = np.finfo(np.float64).tiny
COLOURS = "cividis"
"""From small to large; differs in brightness, too."""


def wrench_figure(
    body: Polyhedron, grasp: Grasp, friction: float, *, view: View | None = None
) -> Any:
    """Shadows of the wrench set: on a plane of the weakest direction, and of forces and torques.

    Args:
        body: The object.
        grasp: On it.
        friction: Coulomb coefficient.
        view: From where forces and torques are seen; as in the grasp's picture if None.

    Returns:
        A matplotlib figure.
    """
    view = view or best_view(body, grasp)
    quality = ferrari_canny(
        grasp, friction=friction, center=body.center_of_mass, torque_scale=body.radius
    )
    wrenches, radius = quality.wrenches, quality.upper
    right, up = view.axes[0], view.axes[1]
    still = np.zeros(3)
    figure = new_figure(9.0, 3.1)
    weakest, forces, torques = panels(figure, 3)
    _shadow(weakest, wrenches, _weakest_plane(wrenches, quality.direction), radius)
    weakest.axvline(radius, color=BAD, linewidth=1.2, label="limiting facet")
    weakest.legend(loc="upper left", fontsize=8.0, frameon=False)
    _label(weakest, "weakest direction", f"along it [N], quality {radius:.3g}", "across it [N]")
    _shadow(forces, wrenches, np.array([[*right, *still], [*up, *still]]), radius)
    _label(forces, "forces", "to the right of the picture [N]", "up [N]")
    _shadow(torques, wrenches, np.array([[*still, *right], [*still, *up]]), radius)
    scale = f"torques over {1e3 * body.radius:.3g} mm"
    _label(torques, scale, "to the right of the picture [N]", "up [N]")
    return figure


def _weakest_plane(wrenches: WrenchSet, direction: Array) -> Array:
    """Two unit vectors: the direction, and one towards the point that is farthest along it."""
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
    """Border of the shadow of an `l1` wrench set: of one contact each, at the rim of its cone.

    Args:
        wrenches: The set.
        plane: Two unit wrenches, (2, 6), rows.

    Returns:
        Points, (TURNS, 2), counter-clockwise.
    """
    angles = np.linspace(0.0, 2.0 * np.pi, TURNS)
    ways = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    slopes = (ways @ plane @ wrenches.G).reshape(TURNS, -1, 3)
    across = np.hypot(slopes[..., 1], slopes[..., 2])
    farthest = np.argmax(slopes[..., 0] + wrenches.friction * across, axis=1)
    rows = np.arange(TURNS)
    forces = np.zeros_like(slopes)
    forces[rows, farthest, 0] = 1.0
    sliding = wrenches.friction[farthest] / np.maximum(across[rows, farthest], TINY)
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


def margin_figure(
    body: Polyhedron, grasp: Grasp, friction: float, *, max_normal_force_n: float = 10.0
) -> Any:
    """Largest force and largest torque resisted, by direction, on maps of the sphere.

    Args:
        body: The object.
        grasp: On it, in force closure.
        friction: Coulomb coefficient.
        max_normal_force_n: Limit of each finger's push.

    Returns:
        A matplotlib figure.
    """
    figure = new_figure(9.0, 2.9)
    unit_torques = body.radius
    around = Around(left=0.01, right=0.02, below=0.02, above=0.1, between=0.05)
    for axes, (name, unit, scale, place) in zip(
        panels(figure, 2, around=around, projection="mollweide"),
        (("force", "N", 1.0, 0), ("torque", "mN m", 1e3 * unit_torques, 3)),
        strict=True,
    ):
        limits = _limits_by_direction(body, grasp, friction, max_normal_force_n, place)
        _map(figure, axes, scale * limits, f"largest {name} resisted [{unit}]")
    return figure


def directions_of_map() -> Array:
    """Unit vectors of a map's nodes, (LATITUDES, LONGITUDES, 3)."""
    longitude, latitude = np.meshgrid(
        np.linspace(-np.pi, np.pi, LONGITUDES), np.linspace(-0.5 * np.pi, 0.5 * np.pi, LATITUDES)
    )
    flat = np.cos(latitude)
    return np.stack([flat * np.cos(longitude), flat * np.sin(longitude), np.sin(latitude)], axis=2)


def _limits_by_direction(
    body: Polyhedron, grasp: Grasp, friction: float, largest: float, place: int
) -> Array:
    """Largest multiples of unit forces [N], or of torques of 1 N at the object's radius."""
    ways = directions_of_map().reshape(-1, 3)
    wrenches = np.zeros((len(ways), 6))
    wrenches[:, place : place + 3] = ways * (body.radius if place else 1.0)
    different, same = np.unique(np.round(wrenches, 12), axis=0, return_inverse=True)
    found = wrench_limits(
        grasp, None, friction, different, max_normal_force=largest, center=body.center_of_mass
    )
    limits = np.array([each.limit for each in found])
    return limits[same.reshape(-1)].reshape(LATITUDES, LONGITUDES)


def _map(figure: Any, axes: Any, values: Array, title: str) -> None:
    longitudes = np.linspace(-np.pi, np.pi, LONGITUDES)
    latitudes = np.linspace(-0.5 * np.pi, 0.5 * np.pi, LATITUDES)
    drawn = axes.pcolormesh(
        longitudes, latitudes, values, cmap=COLOURS, shading="gouraud", rasterized=True,
        vmin=0.0,
    )  # fmt: skip
    row, column = np.unravel_index(int(values.argmin()), values.shape)
    axes.plot([longitudes[column]], [latitudes[row]], "o", mfc="none", mec=BAD, ms=9, mew=2)
    for name, x, y in (("+x", 0.0, 0.0), ("+y", 0.5 * np.pi, 0.0), ("-y", -0.5 * np.pi, 0.0),
                       ("+z", 0.0, 0.45 * np.pi), ("-z", 0.0, -0.45 * np.pi)):  # fmt: skip
        axes.text(x, y, name, ha="center", va="center", fontsize=8.0, color="white",
                  bbox={"boxstyle": "round,pad=0.15", "fc": INK, "ec": "none", "alpha": 0.6}
        )  # fmt: skip
    axes.set_xticks([])
    axes.set_yticks([])
    axes.grid(visible=False)
    entitle(axes, f"{title}: least {values.min():.3g} (circle)")
    bar = figure.colorbar(drawn, ax=axes, shrink=0.75, pad=0.02)
    bar.outline.set_edgecolor(NEUTRAL)
