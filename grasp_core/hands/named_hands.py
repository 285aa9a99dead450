"""Loads the hands whose numbers are built in: `NAME.json` beside this module holds each.

The files are records of `Hand`; `record_of` writes one. Frames, joints and boxes are those of the
sources that they name, to the last digit; sources state turns as quaternions, and boxes in
millimetres.

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
within .1 mm of such a hull hold the mesh, and reach at most .18 mm beyond it. A block is covered by
the box around its corners, whose edges are rounded by 5 mm and by as much as the corners need. The
ball of 10.4 mm, half a block's width, stands for a block where a tip has to be a ball.
"""

from pathlib import Path

from grasp_core.errors import InputError
from grasp_core.files.json_text import object_of
from grasp_core.files.records import from_record
from grasp_core.files.text_files import read_text
from grasp_core.hands.hand import Hand
from grasp_core.kinds import shown, value_of

HANDS = ("allegro", "allegro-urdf", "leap")
"""The names of the hands."""


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
    found = read_text(Path(__file__).with_name(f"{name}.json"))
    return from_record(Hand, object_of(found, "hand"))
