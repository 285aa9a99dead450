"""A hand that stands in a grasp, from stored numbers: no search, so that drawing it is quick.

The numbers are what `gc.reach_with` found once for the grasp `GRASP` of the small box.
"""

from functools import cache

import numpy as np

import grasp_core as gc
import scenes
from grasp_core.closure.contacts import contacts_sha256
from grasp_core.hands.reach import HandReach
from scenes.drawing.hands import posed_hand
from sim_validate.files.result_files import AboutObject
from sim_validate.hands.reaches import ReachedGrasp, Reaches, ReachSettings

FRICTION, CLEARANCE = 0.5, 5e-4
GRASP = "c-0-1-4-5"
FINGERS = ("thumb", "ring", "first", "middle")
JOINTS = (
    -0.003283696, 0.615550999, 0.713768693, 0.945267078, 0.151373432, 0.311815906, 0.865231122,
    0.335434918, 0.293313024, 0.946932106, 0.220749527, 0.967766342, 1.089196691, 0.604668412,
    1.146100229, 0.246721335,
)  # fmt: skip
PALM_POSE = (
    (-0.080622900835, -0.023316487035, 0.996471920976, -0.035880059175),
    (-0.132744184367, 0.991072135829, 0.012450024062, -0.002804258535),
    (-0.98786584584, -0.131272095339, -0.082998238581, 0.09234122914),
    (0.0, 0.0, 0.0, 1.0),
)
POSITIONS = (
    (-0.03, -1.4317e-05, 0.00727462), (0.004744252, -0.021, -0.007357113),
    (0.004728561, 0.021, -0.007471585), (0.03, -0.000271307, 0.004608768),
)  # fmt: skip
NORMALS = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, -1.0, 0.0), (-1.0, 0.0, 0.0))
ROUNDING = 1e-8
"""How far fingertips are from touching, as the numbers above have nine digits [m]."""


@cache
def small_plan():
    """Grasps of a box of 60 by 42 by 30 mm, for fingers as thick as the hand's."""
    box = scenes.example_object("box")
    body = gc.Polyhedron.from_mesh(0.6 * box.vertices, box.triangles, name="small box")
    finger = gc.Finger(radius_m=0.012, approach_m=0.03)
    return gc.plan(body, friction=FRICTION, limit=2, finger=finger)


@cache
def standing():
    """The object, the grasp, the hand, and the pose in which it stands in the grasp."""
    plan, hand = small_plan(), gc.load_hand("allegro")
    names = [finger.name for finger in hand.fingers]
    positions, normals = np.array(POSITIONS), np.array(NORMALS)
    reach = HandReach(
        hand.name, GRASP, "", "", 1, CLEARANCE,
        fingers=np.array([names.index(name) for name in FINGERS]), joints=np.array(JOINTS),
        palm_pose=np.array(PALM_POSE),
        certificate=gc.force_closure(positions, normals, FRICTION), within_regions=(True,) * 4,
    )  # fmt: skip
    return plan.body, plan[GRASP], hand, reach


def held():
    """The hand in its pose, as drawings take it."""
    _, grasp, hand, reach = standing()
    return posed_hand(hand, reach, grasp)


def not_reached(grasp):
    """What a search without success finds."""
    said = "from 3 starts no pose was found: fingertips did not get to their contacts"
    return HandReach("allegro", grasp.id, "collision", said, 3, CLEARANCE)


def run_with_hand(folder):
    """Write a run of two grasps, of which the hand reaches the first, and return its folder."""
    gc.save_grasps(folder / "grasps.json", small_plan())
    (folder / "reaches.json").write_text(reaches_text())
    return folder


@cache
def reaches_text():
    """The text of the reaches.json of that run."""
    body, grasp, hand, reach = standing()
    plan = small_plan()
    (other,) = (each for each in plan if each.id != grasp.id)
    found = tuple(
        ReachedGrasp(reach if each is grasp else not_reached(other), contacts_sha256(each.contacts))
        for each in plan
    )
    about = AboutObject.of(body)
    return Reaches(about, FRICTION, hand, ReachSettings(), None, found, complete=True).text()
