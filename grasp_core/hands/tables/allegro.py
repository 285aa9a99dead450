"""The Allegro hand of Wonik Robotics, version 3, right: joints, ranges and shapes.

Numbers of the URDF that SimLab publishes (BSD-2-Clause, copyright 2016 SimLab), in the frames of
MuJoCo Menagerie's model `wonik_allegro` (BSD-2-Clause), whose capsules stand for the fingertips.
The fingertip is the ball of radius 12 mm at the end of that capsule. Capsules end 2.3 mm (thumb:
.7 mm) beyond the balls of the URDF and its meshes: `allegro-urdf` ends with those. The URDF states
no efforts and Menagerie no torque limits. Menagerie states the mass of the palm and a density of
links, but no masses of links.
"""

import math

import numpy as np

from grasp_core.arrays import Array
from grasp_core.hands.hand import Fingertip, Hand, HandFinger, Joint, Link, LinkShape
from grasp_core.hands.tables.turns import from_quaternion

SOURCES = (
    "SimLab, allegro_hand_description (BSD-2-Clause, copyright 2016 SimLab): joints, ranges, boxes",
    "MuJoCo Menagerie, wonik_allegro (BSD-2-Clause): capsules of the fingertips, pairs that may "
    "overlap",
)
TIPS, URDF_TIPS = (0.029, 0.043), (0.0267, 0.0423)
"""Places of the fingertips' balls along the last links, of fingers and of the thumb, in Menagerie's
model and in the URDF [m]."""
TIP_RADIUS = 0.012
WIDTH_X, WIDTH_Y = 0.0098, 0.01375
"""Half widths of the links of all fingers [m]."""
LEAN = 0.08726646255
"""Turn of the outer fingers against the middle one [rad]."""
RANGES = ((-0.47, 0.47), (-0.196, 1.61), (-0.174, 1.709), (-0.227, 1.618))
THUMB_RANGES = ((0.263, 1.396), (-0.105, 1.163), (-0.189, 1.644), (-0.162, 1.719))
LINKS = ("base", "proximal", "medial", "distal")
ROLL, BEND, THUMB_ROLL = (0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (-1.0, 0.0, 0.0)
Triple = tuple[float, float, float]


def _box(middle: Triple, half: Triple) -> LinkShape:
    return LinkShape(np.array(middle), np.eye(3), np.array(half), 0.0)


def _along(half_z: float) -> LinkShape:
    """Return the box of a link that begins at its joint."""
    return _box((0.0, 0.0, half_z), (WIDTH_X, WIDTH_Y, half_z))


def _capsule(start: float, end: float) -> LinkShape:
    middle, half = (round(0.5 * length, 6) for length in (start + end, end - start))
    return LinkShape(
        np.array([0.0, 0.0, middle]), np.eye(3), np.array([0.0, 0.0, half]), TIP_RADIUS
    )


def _finger(
    name: str, offsets: tuple[Triple, ...], base: Array, axes: tuple[Triple, ...],
    ranges: tuple[tuple[float, float], ...], shapes: tuple[tuple[LinkShape, ...], ...], tip: float,
) -> HandFinger:  # fmt: skip
    links = tuple(
        Link(
            f"{name}_{link}",
            Joint(f"{name}_j{i}", np.array(offsets[i]), base if i == 0 else np.eye(3),
                  np.array(axes[i]), *ranges[i]),
            shapes[i],
        )
        for i, link in enumerate(LINKS)
    )  # fmt: skip
    return HandFinger(name, links, Fingertip(np.array([0.0, 0.0, tip]), TIP_RADIUS))


def _straight(name: str, root: Triple, lean: float, tip: float) -> HandFinger:
    base = from_quaternion(math.cos(0.5 * lean), math.sin(0.5 * lean), 0.0, 0.0)
    shapes = (
        (_along(0.0082),), (_along(0.027),), (_along(0.0192),),
        (_along(0.008), _capsule(0.009, tip)),
    )  # fmt: skip
    offsets = (root, (0.0, 0.0, 0.0164), (0.0, 0.0, 0.054), (0.0, 0.0, 0.0384))
    return _finger(name, offsets, base, (ROLL, BEND, BEND, BEND), RANGES, shapes, tip)


def _thumb(tip: float) -> HandFinger:
    base = from_quaternion(0.477714, -0.521334, -0.521334, -0.477714)
    shapes = (
        (_box((-0.0179, 0.009, 0.0145), (0.0179, 0.017, 0.02275)),), (_along(0.00885),),
        (_along(0.0257),), (_along(0.0157), _capsule(0.027, tip)),
    )  # fmt: skip
    offsets = ((-0.0182, 0.019333, -0.045987), (-0.027, 0.005, 0.0399), (0.0, 0.0, 0.0177),
               (0.0, 0.0, 0.0514))  # fmt: skip
    return _finger("thumb", offsets, base, (THUMB_ROLL, ROLL, BEND, BEND), THUMB_RANGES, shapes,
                   tip)  # fmt: skip


def allegro(name: str = "allegro", tips: tuple[float, float] = TIPS) -> Hand:
    """Return the right Allegro hand.

    Takes `tips` [m].
    """
    finger, thumb = tips
    return Hand(
        name,
        (_box((-0.0093, 0.0, -0.0475), (0.0204, 0.0565, 0.0475)),),
        (
            _straight("first", (0.0, 0.0435, -0.001542), -LEAN, finger),
            _straight("middle", (0.0, 0.0, 0.0007), 0.0, finger),
            _straight("ring", (0.0, -0.0435, -0.001542), LEAN, finger),
            _thumb(thumb),
        ),
        SOURCES,
        ignored_pairs=(("palm", "thumb_proximal"),),
    )
