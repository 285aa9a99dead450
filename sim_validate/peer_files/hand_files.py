"""Holds what DexGraspBench's files of hands say besides the shapes and joints that hands have.

Source: assets/hand of DexGraspBench at the commit of `DexRecord`, with MuJoCo Menagerie's
`leap_hand`, which its file includes, and meshes of Menagerie's `wonik_allegro`, of which MuJoCo
3.3.2 makes Allegro's links, with the density 800 of the file.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np

from grasp_core.arrays import Array
from grasp_core.hands.hand import PALM, Hand

Row: TypeAlias = tuple[float, ...]


@dataclass(frozen=True, slots=True, eq=False)
class HandFile:
    """What a file of a hand says about its root, servos and masses."""

    servo_n_m_per_rad: float = 5.0
    damping_n_m_s_per_rad: float = 0.1
    """Damping of each joint, with that of its servo."""
    root: Array = field(default_factory=lambda: np.eye(4))
    """Pose of the palm in the world of the file, (4, 4)."""
    inertials: Mapping[str, Mapping[str, object]] = field(default_factory=dict[str, Any])
    """MJCF's inertials of palm and links by name; empty where the file has none."""


LINKS = ("base", "proximal", "medial", "distal")
ALLEGRO: tuple[Row, ...] = (
    (351.4, -8.986, -3.957, -40.27, 447.7, 261.1, 283.1, 0.023, -1.612, -26.37),
    (7.232, -0.778, -0.01, 8.282, 0.748, 0.355, 0.707, 0.0, 0.032, -0.001),
    (27.28, 0.0, -0.091, 27.0, 11.86, 11.28, 2.266, 0.0, 0.0, 0.0),
    (18.46, -0.193, -0.078, 22.59, 4.285, 3.636, 1.676, 0.0, -0.073, -0.001),
    (14.36, -0.273, -0.002, 15.9, 2.418, 2.015, 1.193, 0.0, -0.061, 0.0),
    (38.26, -17.92, 8.024, 12.31, 9.166, 10.64, 7.217, -0.018, 0.007, 0.619),
    (7.219, -0.782, -0.01, 8.105, 0.746, 0.354, 0.705, 0.0, 0.032, -0.001),
    (22.5, -0.164, 0.017, 21.11, 7.526, 6.583, 2.143, 0.0, 0.097, 0.0),
    (23.18, 0.0, 0.003, 21.32, 7.132, 6.808, 1.806, 0.0, 0.0, 0.005),
)
"""Palm, links of a finger, links of the thumb: mass [g], centre [mm] and inertia about it [kg mm^2]
(xx, yy, zz, xy, xz, yz), in the link's frame."""
LEAP_THUMB = ("mp", "base", "proximal", "distal")
LEAP: tuple[Row, ...] = (
    (237.0, -49.54, -42.91, -10.23, 293.5, 192.2, 407.2, -35.62, -0.439, -6.247),
    (44.0, -22.52, 33.88, 16.36, 13.16, 10.3, 17.4, 4.266, 0.507, -0.162),
    (32.0, 7.5, -0.2, -11.0, 3.093, 4.373, 4.885, 0.0, 0.0, 0.0),
    (37.0, 5.421, -29.15, 15.0, 7.676, 5.999, 8.16, 1.174, 0.0, 0.0),
    (16.0, -0.879, -27.02, 14.59, 3.711, 1.659, 3.024, -0.125, -0.001, -0.015),
    (32.0, 7.5, -0.2, -11.0, 3.093, 4.373, 4.885, 0.0, 0.0, 0.0),
    (3.0, 0.0, 0.0, -7.081, 0.619, 0.215, 0.535, 0.0, 0.0, 0.0),
    (38.0, -2.059, 15.91, -13.73, 9.814, 4.365, 9.381, 0.124, 0.163, 0.03),
    (49.0, 0.962, -24.2, -14.42, 20.48, 4.778, 20.72, -1.009, -0.206, 0.097),
)
"""Palm, links of a finger, links of LEAP's thumb, in the columns of `ALLEGRO`."""


def _inertials(
    rows: tuple[Row, ...], fingers: tuple[str, ...], thumb: tuple[str, ...]
) -> dict[str, dict[str, object]]:
    """Return the inertials of a table by the names of links."""
    named = [f"{name}_{link}" for name in fingers for link in LINKS]
    names = [PALM, *named, *(f"thumb_{link}" for link in thumb)]
    every = [rows[0], *rows[1:5] * len(fingers), *rows[5:]]
    return {
        name: {"pos": 1e-3 * np.array(row[1:4]), "mass": 1e-3 * row[0],
               "fullinertia": 1e-6 * np.array(row[4:])}
        for name, row in zip(names, every, strict=True)
    }  # fmt: skip


HAND_FILES = {
    "allegro": HandFile(
        5.0, 0.1,
        np.array([[0, 0, 1, 0], [0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 0, 1]], np.float64),
        _inertials(ALLEGRO, ("first", "middle", "ring"), LINKS),
    ),
    "leap": HandFile(
        3.0, 0.04,
        np.array([[1, 0, 0, 0], [0, -1, 0, 0], [0, 0, -1, 0.1], [0, 0, 0, 1]], np.float64),
        _inertials(LEAP, ("index", "middle", "ring"), LEAP_THUMB),
    ),
}  # fmt: skip
"""By the names of built-in hands."""
HAND_FILES["allegro-urdf"] = HAND_FILES["allegro"]


def hand_file(hand: Hand) -> HandFile:
    """Return what the file of a hand says; for others than the built-in ones, the usual values."""
    return HAND_FILES.get(hand.name, HandFile())
