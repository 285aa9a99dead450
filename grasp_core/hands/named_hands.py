"""The hands whose numbers are built in: joints, ranges, shapes and masses, as rows of tables.

*Allegro*, the right hand of Wonik Robotics, version 3. Numbers of the URDF that SimLab publishes
(BSD-2-Clause, copyright 2016 SimLab), in the frames of MuJoCo Menagerie's model `wonik_allegro`
(BSD-2-Clause), whose capsules stand for the fingertips. The fingertip is the ball of radius 12 mm
at the end of that capsule. Capsules end 2.3 mm (thumb: .7 mm) beyond the balls of the URDF and its
meshes: `allegro-urdf` ends with those. The URDF states no efforts and Menagerie no torque limits.
Menagerie states the mass of the palm and a density of links, but no masses of links.

*LEAP*, the right hand of Carnegie Mellon University. Numbers of MuJoCo Menagerie's model
`leap_hand` (MIT, copyright 2023 Ananye Agarwal), which comes from dexsuite's URDF. Boxes, masses
and centres of mass are those of the model. Fingertips are rubber blocks 21 mm wide, 24 mm broad and
rounded at the end: the hulls of the corners of the model's meshes, given to .1 mm. All points
within .1 mm of such a hull hold the mesh, and reach at most .18 mm beyond it. The ball of 10.4 mm,
half a block's width, stands for a block where a tip has to be a ball.
"""

import math
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.arrays import Array
from grasp_core.errors import InputError
from grasp_core.hands.hand import Fingertip, Hand, HandFinger, Joint, Link, LinkShape
from grasp_core.kinds import shown, value_of

Row = tuple[float, ...]
Rows = tuple[Row, ...]
PLAIN = (1.0, 0.0, 0.0, 0.0)
"""Quaternion of no turn."""
NONE = (None, None, None, None)

ALLEGRO_SOURCES = (
    "SimLab, allegro_hand_description (BSD-2-Clause, copyright 2016 SimLab): joints, ranges, boxes",
    "MuJoCo Menagerie, wonik_allegro (BSD-2-Clause): capsules of the fingertips, pairs that may "
    "overlap",
)
ALLEGRO_TIPS, URDF_TIPS = (0.029, 0.043), (0.0267, 0.0423)
"""Places of the fingertips' balls along the last links, of fingers and of the thumb, in Menagerie's
model and in the URDF [m]."""
ALLEGRO_TIP_RADIUS = 0.012
WIDTH_X, WIDTH_Y = 0.0098, 0.01375
"""Half widths of the links of all fingers [m]."""
LEAN = 0.08726646255
"""Turn of the outer fingers against the middle one [rad]."""
ALLEGRO_RANGES = ((-0.47, 0.47), (-0.196, 1.61), (-0.174, 1.709), (-0.227, 1.618))
ALLEGRO_THUMB_RANGES = ((0.263, 1.396), (-0.105, 1.163), (-0.189, 1.644), (-0.162, 1.719))
LINKS = ("base", "proximal", "medial", "distal")
ROLL, BEND, THUMB_ROLL = (0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (-1.0, 0.0, 0.0)
STRAIGHT = ((0.0, 0.0, 0.0164), (0.0, 0.0, 0.054), (0.0, 0.0, 0.0384))
"""Offsets of the joints of a finger behind the first [m]."""
ALLEGRO_THUMB_TURN = (0.477714, -0.521334, -0.521334, -0.477714)
ALLEGRO_THUMB_OFFSETS = ((-0.0182, 0.019333, -0.045987), (-0.027, 0.005, 0.0399),
                         (0.0, 0.0, 0.0177), (0.0, 0.0, 0.0514))  # fmt: skip

LEAP_SOURCES = (
    "MuJoCo Menagerie, leap_hand (MIT, copyright 2023 Ananye Agarwal): joints, ranges, boxes, "
    "masses, corners of the fingertips' meshes",
)
TORQUE_SOURCE = "MuJoCo Playground's model of the hand (Apache-2.0): the motors' current limit"
TORQUE_LIMIT_N_M = 0.2196
TIP_RADIUS = 0.0104
TIP_AT, THUMB_TIP_AT = (-0.0008, -0.0396, 0.0145), (-0.0008, -0.0517, -0.0145)
"""Middles of the balls in the frames of the last links [m]."""
DOWN = (0.0, 0.0, -1.0)
RANGES = ((-0.314, 2.23), (-1.047, 1.047), (-0.506, 1.885), (-0.366, 2.042))
THUMB_RANGES = ((-0.349, 2.094), (-0.349, 2.094), (-0.47, 2.443), (-1.34, 1.88))
THUMB_LINKS = ("mp", "base", "proximal", "distal")
FINGERS = ("index", "middle", "ring")
MASSES_KG, THUMB_MASSES_KG = (0.044, 0.032, 0.037, 0.016), (0.032, 0.003, 0.038, 0.049)
CENTERS = (
    (-0.022516, 0.033882, 0.016359), (0.0075, -0.0002, -0.011), (0.0054215, -0.029148, 0.015),
    (-0.0008794, -0.027019, 0.014594),
)  # fmt: skip
THUMB_CENTERS = (
    (0.0075, -0.0002, -0.011), (0.0, 0.0, -0.0070806), (-0.0020593, 0.015912, -0.013733),
    (0.00096191, -0.024203, -0.014419),
)  # fmt: skip
OFFSETS = ((-0.0122, 0.0381, 0.0145), (0.015, 0.0143, -0.013), (0.0, -0.0361, 0.0002))
"""Offsets of the joints of a finger behind the first [m]."""
ROOTS = ((-0.007, 0.023, -0.0187), (-0.0071, -0.0224, -0.0187), (-0.00709, -0.0678, -0.0187))
TURNS = ((1.0, 1.0, 1.0, -1.0), (1.0, -1.0, -1.0, 1.0), (1.0, 1.0, -1.0, 1.0), (1.0, 0.0, 0.0, 0.0))
THUMB_OFFSETS = ((-0.0693, -0.0012, -0.0216), (0.0, 0.0143, -0.013), (0.0, 0.0145, -0.017),
                 (0.0, 0.0466, 0.0002))  # fmt: skip
THUMB_TURNS = ((1.0, 0.0, 1.0, 0.0), (1.0, 1.0, -1.0, 1.0), (1.0, -1.0, 0.0, 0.0),
               (0.0, 0.0, 0.0, 1.0))  # fmt: skip
"""Quaternions, not yet of length one."""
PALM: Rows = (
    (-9, 8, -11, 11, 13, 17), (-9, -37, -11, 11, 13, 17), (-9, -82, -11, 11, 13, 17),
    (-66, -78, -11.5, 29, 10, 23, 0.989016, 0, 0, -0.147806), (-30, -35, -3, 10, 60, 15),
    (-32, -35, -24, 5, 60, 10, 0.923956, 0, 0.382499, 0), (-48, -33, -11.5, 12, 58, 23),
    (-78, -53, -11.5, 22, 26, 23), (-98, -9, -6, 2, 18, 17), (-78, -3, 10, 22, 28, 2),
)  # fmt: skip
"""Boxes: the middle, then the half-sizes [mm], then the quaternion if the box is turned."""
BOXES: tuple[Rows, ...] = (
    (
        (0, 18, 14.7, 10, 3, 17), (-27, 42, 15, 14, 20, 10), (-26.2, 20, 14.6, 17, 3, 10),
        (-29.5, 35, 29, 10, 12, 4), (0, 5, 30, 7, 10, 2), (0, 5, -1, 7, 10, 2),
    ),
    ((7.5, -0.2, -11, 17, 13, 11),),
    (
        (0, -20, 15, 8, 3, 13), (0, -16, 15, 10, 2, 17), (0, -4.5, 30, 7, 10, 2),
        (0, -4.5, 0, 7, 10, 2), (7.5, -35, 15, 17, 11, 13),
    ),
    ((0, -17, 15, 10, 3, 15), (0, -6, 30, 7, 11, 2), (0, -6, -1, 7, 11, 2)),
)  # fmt: skip
THUMB_BOXES: tuple[Rows, ...] = (
    ((-7.5, -0.2, -11, 17, 13, 11),),
    ((0, 0, -1.5, 9, 16.5, 2), (0, -15, -13, 7, 2, 10), (0, 15, -13, 7, 2, 10)),
    (
        (0, 10.5, -14, 10, 20, 12), (0, 31, -15, 10, 2, 16), (0, 42, 1, 7, 10, 2),
        (0, 42, -29, 7, 10, 2), (-13.5, 17.5, -11.656, 5, 12, 9),
    ),
    ((0, -8.5, -15, 10, 18, 12), (0, -29, -14, 10, 2, 15), (15, -17.5, -11.5, 4, 12, 9)),
)  # fmt: skip
TIP_ROUNDING = 1e-4
"""More than the rounding of the corners moves one [m]."""
TIP_CORNERS: Rows = (
    (4, -500, 136), (2, -498, 103), (-101, -497, 160), (3, -493, 203), (-93, -492, 88),
    (33, -490, 94), (-110, -485, 107), (-92, -484, 219), (-109, -482, 196), (-87, -480, 63),
    (35, -478, 221), (58, -478, 146), (31, -471, 58), (-110, -462, 66), (9, -461, 246),
    (-110, -452, 228), (59, -452, 61), (-84, -449, 253), (-83, -448, 38), (84, -445, 99),
    (69, -444, 225), (42, -443, 249), (86, -443, 189), (11, -439, 32), (-97, -437, 40),
    (-98, -434, 250), (53, -408, 34), (95, -408, 144), (83, -404, 61), (92, -403, 81),
    (76, -401, 237), (26, -399, 24), (48, -399, 259), (-62, -398, 24), (20, -397, 266),
    (95, -397, 197), (-59, -396, 267), (-113, -219, 214), (-112, -217, 70), (-107, -202, 146),
    (20, -199, 266), (34, -198, 27), (79, -198, 54), (-62, -197, 24), (55, -197, 255),
    (84, -197, 227), (96, -197, 98), (96, -197, 191), (-96, -196, 251), (-95, -196, 41),
    (-86, -196, 31), (-66, -196, 266),
)  # fmt: skip
THUMB_TIP_CORNERS: Rows = (
    (-88, -621, -146), (6, -619, -181), (27, -615, -117), (-92, -614, -93), (3, -613, -87),
    (-107, -612, -150), (-91, -606, -214), (17, -602, -218), (-88, -600, -64), (56, -599, -179),
    (47, -593, -73), (67, -589, -104), (-91, -578, -245), (-112, -577, -69), (-108, -577, -230),
    (16, -575, -42), (51, -574, -236), (70, -571, -216), (13, -569, -252), (-86, -567, -38),
    (84, -565, -189), (86, -562, -94), (-99, -556, -42), (68, -554, -55), (-88, -544, -258),
    (-77, -537, -27), (-67, -533, -264), (95, -529, -101), (89, -520, -74), (-24, -519, -23),
    (74, -517, -242), (19, -516, -266), (68, -516, -43), (90, -516, -217), (31, -515, -25),
    (96, -515, -192), (-113, -339, -80), (-112, -337, -214), (-106, -337, -238), (20, -319, -24),
    (23, -318, -266), (65, -318, -41), (89, -318, -218), (89, -318, -72), (-93, -317, -36),
    (-63, -317, -24), (-62, -317, -266), (56, -317, -254), (96, -317, -191), (96, -317, -99),
    (-94, -316, -250), (-95, -315, -40),
)  # fmt: skip
"""Corners of the blocks in the frames of the last links [0.1 mm]."""
ROUND = 0.005
"""How far the edges of a block are rounded, nearly [m]."""


def _rotation(quaternion: Row) -> Array:
    w, x, y, z = quaternion
    a, b, c, d = np.array([w, x, y, z]) / math.sqrt(w * w + x * x + y * y + z * z)
    return np.array(
        [
            [a * a + b * b - c * c - d * d, 2.0 * (b * c - a * d), 2.0 * (b * d + a * c)],
            [2.0 * (b * c + a * d), a * a - b * b + c * c - d * d, 2.0 * (c * d - a * b)],
            [2.0 * (b * d - a * c), 2.0 * (c * d + a * b), a * a - b * b - c * c + d * d],
        ]
    )


def _box(
    middle: ArrayLike, half: ArrayLike, turn: Row = PLAIN, radius: float = 0.0
) -> LinkShape:  # fmt: skip
    return LinkShape(np.array(middle), _rotation(turn), np.array(half), radius)


def _finger(
    name: str, tip: Fingertip, rows: Iterable[tuple[Any, ...]], torque_limit: float | None = None
) -> HandFinger:
    """Make a finger of rows: name, offset, quaternion, axis, range, shapes, mass and its centre."""
    made = tuple(
        Link(
            f"{name}_{link}",
            Joint(f"{name}_j{i}", np.array(offset), _rotation(turn), np.array(axis), ends[0],
                  ends[1], torque_limit),
            shapes, mass, None if center is None else np.array(center),
        )
        for i, (link, offset, turn, axis, ends, shapes, mass, center) in enumerate(rows)
    )  # fmt: skip
    return HandFinger(name, made, tip)


def _allegro(name: str = "allegro", tips: tuple[float, float] = ALLEGRO_TIPS) -> Hand:

    def along(half_z: float) -> LinkShape:  # the box of a link that begins at its joint
        return _box((0.0, 0.0, half_z), (WIDTH_X, WIDTH_Y, half_z))

    def capsule(start: float, end: float) -> LinkShape:
        middle, half = (round(0.5 * length, 6) for length in (start + end, end - start))
        return _box((0.0, 0.0, middle), (0.0, 0.0, half), radius=ALLEGRO_TIP_RADIUS)

    far, thumb = (Fingertip(np.array([0.0, 0.0, at]), ALLEGRO_TIP_RADIUS) for at in tips)
    straight = ((along(0.0082),), (along(0.027),), (along(0.0192),),
                (along(0.008), capsule(0.009, tips[0])))  # fmt: skip
    fingers = (
        _finger(own, far, zip(
            LINKS, (root, *STRAIGHT),
            ((math.cos(0.5 * lean), math.sin(0.5 * lean), 0.0, 0.0), PLAIN, PLAIN, PLAIN),
            (ROLL, BEND, BEND, BEND), ALLEGRO_RANGES, straight, NONE, NONE, strict=True,
        ))
        for own, root, lean in (
            ("first", (0.0, 0.0435, -0.001542), -LEAN), ("middle", (0.0, 0.0, 0.0007), 0.0),
            ("ring", (0.0, -0.0435, -0.001542), LEAN),
        )
    )  # fmt: skip
    thumb_shapes = (
        (_box((-0.0179, 0.009, 0.0145), (0.0179, 0.017, 0.02275)),), (along(0.00885),),
        (along(0.0257),), (along(0.0157), capsule(0.027, tips[1])),
    )  # fmt: skip
    last = _finger("thumb", thumb, zip(
        LINKS, ALLEGRO_THUMB_OFFSETS, (ALLEGRO_THUMB_TURN, PLAIN, PLAIN, PLAIN),
        (THUMB_ROLL, ROLL, BEND, BEND), ALLEGRO_THUMB_RANGES, thumb_shapes, NONE, NONE, strict=True,
    ))  # fmt: skip
    palm = (_box((-0.0093, 0.0, -0.0475), (0.0204, 0.0565, 0.0475)),)
    return Hand(
        name, palm, (*fingers, last), ALLEGRO_SOURCES, ignored_pairs=(("palm", "thumb_proximal"),)
    )


def _leap_shape(row: Row) -> LinkShape:
    numbers = 1e-3 * np.array(row[:6])
    return _box(numbers[:3], numbers[3:], row[6:] or PLAIN)


def _leap_end(tip: Row, block: Rows) -> tuple[Fingertip, LinkShape]:
    """Make a fingertip, and what covers it."""
    corners = 1e-4 * np.array(block)
    low, high = corners.min(axis=0), corners.max(axis=0)
    middle, half = 0.5 * (low + high), 0.5 * (high - low) - ROUND
    out = np.linalg.norm(np.maximum(np.abs(corners - middle) - half, 0.0), axis=1)
    cover = _box(middle, half, radius=float(out.max()) + TIP_ROUNDING)
    return Fingertip(np.array(tip), TIP_RADIUS, corners, TIP_ROUNDING), cover


def _leap() -> Hand:

    def finger(
        name: str, rows: Iterable[tuple[Any, ...]], boxes: tuple[Rows, ...], tip: Row, block: Rows
    ) -> HandFinger:
        end, cover = _leap_end(tip, block)
        shapes = [tuple(map(_leap_shape, each)) for each in boxes]
        shapes[-1] += (cover,)
        links = [(*row[:3], DOWN, row[3], own, *row[4:])
                 for row, own in zip(rows, shapes, strict=True)]  # fmt: skip
        return _finger(name, end, links, TORQUE_LIMIT_N_M)

    fingers = (
        finger(
            name, zip(LINKS, (root, *OFFSETS), TURNS, RANGES, MASSES_KG, CENTERS, strict=True),
            BOXES, TIP_AT, TIP_CORNERS,
        )
        for name, root in zip(FINGERS, ROOTS, strict=True)
    )  # fmt: skip
    rows = zip(THUMB_LINKS, THUMB_OFFSETS, THUMB_TURNS, THUMB_RANGES, THUMB_MASSES_KG,
               THUMB_CENTERS, strict=True)  # fmt: skip
    thumb = finger("thumb", rows, THUMB_BOXES, THUMB_TIP_AT, THUMB_TIP_CORNERS)
    bases = [f"{name}_base" for name in FINGERS]
    return Hand(
        "leap", tuple(map(_leap_shape, PALM)), (*fingers, thumb), LEAP_SOURCES, TORQUE_SOURCE,
        ignored_pairs=(
            *(("palm", f"{name}_{link}") for name in FINGERS for link in ("proximal", "medial")),
            ("palm", "thumb_base"), ("palm", "thumb_proximal"), *combinations(bases, 2),
            *(("thumb_mp", base) for base in bases),
        ),
    )  # fmt: skip


HANDS: Mapping[str, Callable[[], Hand]] = {
    "allegro": _allegro,
    "allegro-urdf": partial(_allegro, "allegro-urdf", URDF_TIPS),
    "leap": _leap,
}
"""What makes each hand, by its name."""


def hand_names() -> tuple[str, ...]:
    """Return the names of the hands whose numbers are built in."""
    return tuple(HANDS)


def load_hand(name: str) -> Hand:
    """Return a hand whose numbers are built in.

    Args:
        name: "allegro", "allegro-urdf" (the same with fingertips as in the maker's URDF) or "leap";
            `scenes.load_hand` also reads files.

    Raises:
        InputError: There is no such hand.
    """
    if value_of(str, name, "name") not in HANDS:
        raise InputError(
            f"name must be that of a built-in hand, {' or '.join(HANDS)}, got {shown(name)}; "
            "scenes.load_hand(path, fingertips=...) reads files"
        )
    return HANDS[name]()
