"""Charts of one trial over time: how far object and fingers moved, and how hard fingers pushed."""

import math
from typing import Any

import numpy as np

from grasp_core.arrays import Array
from scenes.drawing.canvas import entitle, figure_with_panels, in_style
from scenes.drawing.palette import BAD, FINGERS, INK, NEUTRAL
from sim_validate.replaying.replay import Replayed

MICRO = 1e6
LEAST_UM = 1e-4
"""Displacement at which the chart's logarithmic axis begins [um]."""
LEAST_PUSH = 1e-3
"""Share of a finger's largest push below which its use of friction is not shown."""


@in_style
def motion_figure(found: Replayed, threshold_m: float) -> Any:
    """Draw displacement, normal forces and use of friction over the time of one trial.

    Args:
        found: The replayed trial.
        threshold_m: Displacement that counts as motion [m].

    Returns:
        A matplotlib figure. Friction is lowered to the one under test at time zero.
    """
    figure, (moved, pushed, used) = figure_with_panels(9.0, 2.8, 3)
    watched, trace = found.watched, found.watched.trace
    times = trace.times_s
    moved.plot(times, MICRO * trace.displacements_m, color=INK, label="object")
    for finger, colour in enumerate(FINGERS[: trace.slips_m.shape[1]]):
        moved.plot(times, MICRO * trace.slips_m[:, finger], color=colour, linewidth=1.0,
                   label=f"finger {finger} slid")  # fmt: skip
    moved.axhline(MICRO * threshold_m, color=BAD, linestyle="--", label="counts as moved")
    moved.set_yscale("log")
    moved.minorticks_off()
    finite = trace.displacements_m[np.isfinite(trace.displacements_m)]
    highest = MICRO * max(threshold_m, float(finite.max(initial=0.0)))
    moved.set_ylim(LEAST_UM, 100.0 * highest)
    moved.yaxis.set_ticks(10.0 ** np.arange(-4, math.log10(100.0 * highest), 2))
    moved.yaxis.set_major_formatter("{x:g}")
    _label(moved, "displacement [µm]")
    moved.legend(fontsize=7.0, loc="upper left", ncols=2)
    _forces(pushed, watched.times_s, watched.pushes_n[..., 0])
    _label(pushed, "normal force [N]")
    _forces(used, watched.times_s, friction_used(watched.pushes_n, watched.friction))
    used.axhline(1.0, color=BAD, linestyle="--", label="slips")
    used.set_ylim(0.0, 1.15)
    _label(used, "share of friction used")
    return figure


def friction_used(pushes: Array, friction: Array) -> Array:
    """Compute tangential over normal force, over friction, (n, k); NaN if fingers hardly push.

    Args:
        pushes: Forces along (normal, tangent, tangent), (n, k, 3) [N].
        friction: Coulomb coefficients, (n,).
    """
    normal = pushes[..., 0]
    tangential = np.hypot(pushes[..., 1], pushes[..., 2])
    pushing = normal > LEAST_PUSH * max(float(normal.max(initial=0.0)), 1e-12)
    safe = np.where(pushing, normal, 1.0) * friction[:, None]
    return np.where(pushing, tangential / safe, np.nan)


def _forces(axes: Any, times: Array, values: Array) -> None:
    for finger, colour in enumerate(FINGERS[: values.shape[1]]):
        axes.plot(times, values[:, finger], color=colour, label=f"finger {finger}")
    axes.axvline(0.0, color=NEUTRAL, linewidth=0.8, linestyle=":")


def _label(axes: Any, title: str) -> None:
    entitle(axes, title)
    axes.set_xlabel("time since friction was lowered [s]")
