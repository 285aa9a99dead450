"""Runs the command `hand`, which shows what a hand was read as."""

import math

from grasp_core.declared import counted
from grasp_core.files.records import record_of
from grasp_core.hands.couplings import Coupling
from grasp_core.hands.hand import Hand
from grasp_core.hands.named_hands import HANDS
from scenes.hand_files.loading import load_hand
from sim_validate.hands import flags as hand_flags
from sim_validate.kit.console import Reporter
from sim_validate.kit.exit_codes import Exit

MM = 1e3
SMALL_RANGE = math.radians(10.0)
"""Fingers whose joints all turn by less hardly open [rad]."""
SHAPES_WEIGH = "MuJoCo gives links without inertia in the file that of their shapes at 1,000 kg/m^3"


def asked_hand(command: hand_flags.Hand | hand_flags.Reach) -> Hand:
    """Load the hand that a command names."""
    names = (name.strip() for name in command.fingertips.split(","))
    return load_hand(command.hand, [name for name in names if name])


def show_hand(command: hand_flags.Hand, reporter: Reporter) -> int:
    """Show fingers, joints and fingertips of a hand."""
    hand = asked_hand(command)
    reporter.document(record_of(hand))
    fingers = [
        (
            f.name, str(len(f.links)), f"{MM * f.tip.radius:.1f}",
            "ball" if f.tip.corners is None else f"block of {len(f.tip.corners)} corners",
            str(sum(len(link.shapes) for link in f.links)),
        )
        for f in hand.fingers
    ]  # fmt: skip
    reporter.table(
        f"fingers of {hand.name}", ("fingertip", "joints", "radius mm", "kind", "shapes"), fingers
    )
    columns = ("joint", "fingertip", "range deg", "torque limit N m")
    links = [(finger, link.joint) for finger in hand.fingers for link in finger.links]
    joints = [
        (
            joint.name, finger.name, f"{math.degrees(low):.1f} to {math.degrees(high):.1f}",
            "none stated" if joint.torque_limit_n_m is None else f"{joint.torque_limit_n_m:g}",
        )
        for (finger, joint), (low, high) in zip(links, hand.ranges.tolist(), strict=True)
    ]  # fmt: skip
    reporter.table("joints, from the palm outwards", columns, joints)
    reporter.say(f"The palm has {counted(len(hand.palm), 'shape')} that must touch nothing.")
    if hand.ignored_pairs:
        listed = ", ".join(" and ".join(pair) for pair in hand.ignored_pairs)
        reporter.say(f"Links that may overlap, besides neighbours: {listed}.")
    if hand.couplings:
        reporter.say(f"Joints that follow others: {', '.join(map(_follows, hand.couplings))}.")
    reporter.say(f"Torque limits: {hand.torque_source}.")
    reporter.say(_weight(hand))
    if all(joint.highest - joint.lowest < SMALL_RANGE for joint in hand.joints):
        reporter.say(
            f"Every joint turns by less than {math.degrees(SMALL_RANGE):g} degrees: MJCF counts "
            'angles in degrees unless it has <compiler angle="radian"/>.'
        )
    for note in hand.notes:
        reporter.say(f"Note: {note}.")
    for source in hand.sources:
        reporter.say(f"Source: {source}.")
    return Exit.GOOD


def _weight(hand: Hand) -> str:
    masses = [link.mass_kg for link in hand.links]
    stated = [mass for mass in masses if mass is not None]
    if len(stated) < len(masses):
        return "Masses of links: unknown; without them gravity does not load the motors."
    said = f"The links of the fingers weigh {1e3 * sum(stated):.3g} g together"
    return said + ("." if hand.name in HANDS else f"; {SHAPES_WEIGH}.")


def _follows(coupling: Coupling) -> str:
    """Write a coupling as a formula, angles in degrees."""
    said = f"{coupling.joint} = {coupling.ratio:g} {coupling.driver}"
    offset = math.degrees(coupling.offset)
    return f"{said} {'-' if offset < 0.0 else '+'} {abs(offset):.4g} deg" if offset else said
