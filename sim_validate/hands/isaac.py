"""Writes poses of a hand in grasps of an object as an Isaac grasp file, version 1.0.

A grasp of the format is the pose of a gripper's frame in the object's, and the angles of its joints
where it touches (`cspace_position`) and where it is open (`pregrasp_cspace_position`). Isaac Sim's
Grasp Editor takes both angles of each joint that it finds in the first, so that a grasp without an
open posture has no place in a file. The gripper's frame is that of the palm, and joints have the
names of the hand's file, those that follow others too. A joint that fingers have in common stands
once: its copies are no joints of the file.

The frames are named for people, and no reader of NVIDIA's takes them. Of the two spellings on its
pages, `object_frame` and `object_frame_link`, the first is written, as the Grasp Editor writes it,
and it alone, as stricter readers know no other.

Sources:
    NVIDIA, "Isaac Grasp File", nvidia-isaac-ros.github.io/concepts/manipulation/isaac_grasp.html,
    and "Grasp Editor", docs.isaacsim.omniverse.nvidia.com, with the reader that it documents,
    `import_grasps_from_file` of isaacsim.robot_setup.grasp_editor.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from grasp_core.arrays import Array
from grasp_core.errors import InputError
from grasp_core.hands.hand import Hand
from grasp_core.hands.reach import OBEYED
from scenes.mujoco.mjcf_text import quaternion
from sim_validate.files.toml_files import quoted
from sim_validate.hands.reaches import ReachedGrasp

UNTRIED = 0.5
"""Confidence in a grasp that was not simulated: planners that take the most trusted grasps first
take it after those that held, and before those that did not."""
BY_THE_HAND = "1.0 if the hand passed all simulated trials, 0.0 if not, 0.5 if none was simulated"
HEAD = """\
# The hand {hand} in grasps of {of}: metres and radians, the frame of the object's mesh,
# and joints by the names that `graspproof hand` prints.
# confidence: {confidence}
format: isaac_grasp
format_version: 1.0

object_frame: {of}
gripper_frame: {palm}

grasps:
"""


@dataclass(frozen=True, slots=True, eq=False)
class IsaacGrasp:
    """A pose of a hand in a grasp, with the fingers closed and open."""

    name: str
    confidence: float
    palm_pose: Array  # pose of the palm in the object's frame, (4, 4)
    joints: Array  # angles of the hand's joints where it touches, (j,) [rad]
    open_joints: Array  # angles with open fingers, (j,) [rad]


def reached_grasps(found: Iterable[ReachedGrasp]) -> list[IsaacGrasp]:
    """Take the poses in which a hand can open its fingers."""
    return [
        IsaacGrasp(each.id, _confidence(each), reach.palm_pose, reach.joints, reach.pregrasp)
        for each in found
        if (reach := each.reach).palm_pose is not None
        and reach.joints is not None
        and reach.pregrasp is not None
    ]


def _confidence(found: ReachedGrasp) -> float:
    if found.simulated is None and found.executed is None:
        return UNTRIED
    return float(found.good)


def isaac_text(hand: Hand, of: str, grasps: Iterable[IsaacGrasp], confidence: str) -> str:
    """Write a file; equal grasps give equal texts, and no digit is lost.

    Args:
        hand: The hand.
        of: Name of the object, which its frame has too.
        grasps: One or more poses of the hand.
        confidence: What the confidence of a grasp says, as a line of comment.
    """
    head = HEAD.format(
        hand=quoted(hand.name), of=quoted(of), confidence=confidence, palm=quoted(hand.palm_link)
    )
    lines = [line for grasp in grasps for line in _lines(hand, grasp)]
    return head + "\n".join([*lines, ""])


def _lines(hand: Hand, grasp: IsaacGrasp) -> Iterator[str]:
    pose = grasp.palm_pose
    w, *xyz = quaternion(pose[:3, :3]).tolist()
    yield f"  {quoted(grasp.name)}:"
    yield f"    confidence: {_number(grasp.confidence)}"
    yield f"    position: {_listed(pose[:3, 3].tolist())}"
    yield f"    orientation: {{w: {_number(w)}, xyz: {_listed(xyz)}}}"
    for key, angles in (
        ("cspace_position", grasp.joints),
        ("pregrasp_cspace_position", grasp.open_joints),
    ):
        yield f"    {key}:"
        for name, angle in _by_name(hand, angles, grasp.name).items():
            yield f"      {quoted(name)}: {_number(angle)}"


def _by_name(hand: Hand, angles: Array, grasp: str) -> dict[str, float]:
    """Return angles by the joints of the hand's file, those that fingers have in common once."""
    found = dict[str, float]()
    for name, angle in zip(hand.file_joints, angles.tolist(), strict=True):
        if abs(found.setdefault(name, angle) - angle) > OBEYED:
            raise InputError(
                f"{grasp}: joint {name} of {hand.name} must have one angle, got {found[name]:.6g} "
                f"and {angle:.6g} rad for two fingers; look for the pose again"
            )
    return found


def _listed(numbers: list[float]) -> str:
    return f"[{', '.join(map(_number, numbers))}]"


def _number(value: float) -> str:
    """Write a number for YAML 1.1, which takes one with an exponent and no point for text."""
    text = repr(value)
    return text if "." in text else text.replace("e", ".0e")
