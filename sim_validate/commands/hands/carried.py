"""Finds what the hand carries in the grasps that it reaches, whichever way it is turned."""

from collections.abc import Mapping, Sequence

from grasp_core.errors import InputError, SolverError
from grasp_core.execution.carried_mass import HandPayload
from grasp_core.hands.hand import Hand
from grasp_core.hands.hand_motors import hand_payload
from grasp_core.hands.reach import HandReach
from grasp_core.records.grasps_json import SavedGrasps
from sim_validate.cli.console import Reporter
from sim_validate.hands.validate_hand import MOST_PUSH_N

COLUMN = "payload kg"


def carried(hand: Hand, saved: SavedGrasps, found: Sequence[HandReach]) -> dict[str, HandPayload]:
    """Find the largest mass in any orientation, by the ids of the grasps that are reached.

    Gives nothing for a hand whose motors or links are not known well enough, and none for grasps in
    which motors cannot carry their links.
    """
    unknown = any(link.mass_kg is None or link.center_of_mass is None for link in hand.links)
    if unknown or any(joint.torque_limit_n_m is None for joint in hand.free_joints):
        return {}
    each = ((reach.grasp, _payload(hand, saved, reach)) for reach in found if reach.reached)
    return {grasp: payload for grasp, payload in each if payload is not None}


def _payload(hand: Hand, saved: SavedGrasps, reach: HandReach) -> HandPayload | None:
    try:
        return hand_payload(hand, saved.body, reach, saved.friction, max_push_n=MOST_PUSH_N)
    except (InputError, SolverError):  # a figure beside the poses, which are there without it
        return None


def say_what_it_means(payloads: Mapping[str, HandPayload], reporter: Reporter) -> None:
    """Say what the column of the table about poses is."""
    if payloads:
        reporter.say(
            f"{COLUMN}: the largest mass that the motors hold whichever way the hand is turned, "
            "their links included, with forces chosen anew for each orientation"
        )
