"""Holds what DexGraspBench's files of hands say besides the shapes and joints that hands have.

Source: assets/hand of DexGraspBench at the commit of `DexRecord`, with MuJoCo Menagerie's
`leap_hand`, which its file includes. There MuJoCo makes Allegro's links of meshes of the density
800; ours are solids of the same density, whose masses are within a sixth of those.
"""

from dataclasses import dataclass, field

import numpy as np

from grasp_core.arrays import Array
from grasp_core.hands.hand import Hand


@dataclass(frozen=True, slots=True, eq=False)
class HandFile:
    """What a file of a hand says about its root, servos and masses."""

    servo_n_m_per_rad: float = 5.0
    damping_n_m_s_per_rad: float = 0.1
    """Damping of each joint, with that of its servo."""
    density_kg_m3: float = 1000.0
    """Density of shapes without a mass: MuJoCo's own unless the file states one."""
    palm_mass_kg: float | None = None
    root: Array = field(default_factory=lambda: np.eye(4))
    """Pose of the palm in the world of the file, (4, 4)."""


HAND_FILES = {
    "allegro": HandFile(
        density_kg_m3=800.0,
        root=np.array([[0, 0, 1, 0], [0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 0, 1]], np.float64),
    ),
    "leap": HandFile(
        3.0, 0.04, palm_mass_kg=0.237,
        root=np.array([[1, 0, 0, 0], [0, -1, 0, 0], [0, 0, -1, 0.1], [0, 0, 0, 1]], np.float64),
    ),
}  # fmt: skip
"""By the names of built-in hands."""


def hand_file(hand: Hand) -> HandFile:
    """Return what the file of a hand says; for others than the built-in ones, the usual values."""
    return HAND_FILES.get(hand.name, HandFile())
