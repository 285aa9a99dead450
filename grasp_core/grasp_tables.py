"""Finds, chooses and tabulates grasps by their ids, families and figures."""

import importlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, get_args

import numpy as np

from grasp_core.checked import number, one_of, shown
from grasp_core.errors import InputError
from grasp_core.values import Family, Grasp

SHOWN_IDS = 5
"""Largest number of ids that a message lists."""
AXES = ("x", "y", "z")


@dataclass(frozen=True, slots=True)
class Demands:
    """What a grasp has to be like in order to be chosen; None demands nothing."""

    family: Family | None = None
    min_radius_m: float | None = None
    """Least radius of the discs in which fingers may stand [m]."""
    min_closure_margin: float | None = None
    max_critical_friction: float | None = None
    min_ferrari_canny_n: float | None = None
    """Least proved lower bound of the quality [N]."""
    where: Callable[[Grasp], bool] | None = None
    """A further test of the user's own."""

    def __post_init__(self) -> None:
        if self.family is not None:
            one_of(self.family, get_args(Family), "family")
        figures = ("min_radius_m", "min_closure_margin", "max_critical_friction")
        for name in (*figures, "min_ferrari_canny_n"):
            if (least := getattr(self, name)) is not None:
                number(least, name)
        if self.where is not None and not callable(self.where):
            raise InputError(
                f"where must be a function of a grasp that gives True or False, got "
                f"{shown(self.where)}"
            )

    def are_met_by(self, grasp: Grasp) -> bool:
        """Return whether a grasp is chosen; only figures that are asked for are computed."""
        most = self.max_critical_friction
        return (
            (self.family is None or grasp.family == self.family)
            and (self.min_radius_m is None or grasp.radius >= self.min_radius_m)
            and (self.min_closure_margin is None or grasp.closure_margin >= self.min_closure_margin)
            and (most is None or grasp.critical_friction <= most)
            and (
                self.min_ferrari_canny_n is None
                or grasp.ferrari_canny[0] >= self.min_ferrari_canny_n
            )
            and (self.where is None or bool(self.where(grasp)))
        )


def grasp_named(grasps: Sequence[Grasp], wanted: str) -> Grasp:
    """Return the grasp with an id.

    Raises:
        KeyError: No grasp has this id; the message lists some that there are.
    """
    found = next((grasp for grasp in grasps if grasp.id == wanted), None)
    if found is None:
        names = ", ".join(grasp.id for grasp in grasps[:SHOWN_IDS]) or "no grasps"
        more = f" and {len(grasps) - SHOWN_IDS} more" if len(grasps) > SHOWN_IDS else ""
        raise KeyError(f"no grasp is named {shown(wanted)}; there are {names}{more}")
    return found


def data_frame(grasps: Sequence[Grasp]) -> Any:
    """Return a `pandas.DataFrame` with a row for each grasp, indexed by id.

    Columns have the names and units of `grasps.json`: `family`, `radius_m`, `span_angle_deg`,
    `critical_friction`, `closure_margin`, `ferrari_canny_lower_n` and `_upper_n`; for each finger
    `face_0`, its contact `position_0_x_m` and its inward normal `normal_0_x`, and so on.

    Raises:
        InputError: The library pandas is not installed.
    """
    try:
        pandas: Any = importlib.import_module("pandas")
    except ImportError as error:
        raise InputError(
            "to_dataframe: expected that pandas is installed, but it is not; install it with "
            "pip install pandas"
        ) from error
    index = pandas.Index([grasp.id for grasp in grasps], name="id")
    return pandas.DataFrame([_row(grasp) for grasp in grasps], index=index)


def _row(grasp: Grasp) -> Mapping[str, object]:
    lower, upper = grasp.ferrari_canny
    row: dict[str, object] = {
        "family": grasp.family,
        "radius_m": grasp.radius,
        "span_angle_deg": float(np.degrees(grasp.span_angle)),
        "critical_friction": grasp.critical_friction,
        "closure_margin": grasp.closure_margin,
        "ferrari_canny_lower_n": lower,
        "ferrari_canny_upper_n": upper,
    }
    for finger, face in enumerate(grasp.faces):
        row[f"face_{finger}"] = face
    for finger, contact in enumerate(grasp.contacts):
        for axis, at, along in zip(AXES, contact.position, contact.normal, strict=True):
            row[f"position_{finger}_{axis}_m"] = float(at)
            row[f"normal_{finger}_{axis}"] = float(along)
    return row
