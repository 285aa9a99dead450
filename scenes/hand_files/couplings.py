"""Finds which joints of a hand follow others in a compiled model, and refuses other rules.

Rules that hold a joint at a linear function of another (`<mimic>` of URDF, `<equality><joint>` of
MJCF) are followed to a joint that follows none. Of joints that move together one is the hand's free
joint: that one, if it is on the way to a fingertip and has a motor or no other has; otherwise the
first with a motor, or the first. Joints off the way to a fingertip count by their ranges.
"""

from dataclasses import dataclass

import numpy as np

from grasp_core.errors import InputError
from scenes.hand_files.fingers import Chains, path_of_body
from scenes.hand_files.model import HandModel
from scenes.hand_files.model_text import listed


@dataclass(frozen=True, slots=True)
class Line:
    """A joint's angle as a linear function: `offset + ratio * angle of the root`."""

    root: int  # the joint that moves freely; -1 for a constant angle
    ratio: float
    offset: float


@dataclass(frozen=True, slots=True)
class Followers:
    """How joints of a hand move together."""

    lines: dict[int, Line]  # of joints on the way to fingertips that follow others
    ranges: dict[int, tuple[float, float]]  # where they are not the file's [rad]
    notes: tuple[str, ...]


def followers(model: HandModel, found: Chains, name: str) -> Followers:
    """Find which joints follow others."""
    used = {joint for chain in found.joints for joint in chain}
    _refuse_loops(model, used, name)
    lines = _lines(model, used, name)
    roots = {line.root for joint, line in lines.items() if joint in used and line.root >= 0}
    kept, ranges = dict[int, Line](), dict[int, tuple[float, float]]()
    for joint in used & lines.keys():
        if (constant := lines[joint]).root < 0:
            ranges[joint] = constant.offset, constant.offset
    aside = list[str]()
    for root in sorted(roots):
        own = {root: Line(root, 1.0, 0.0)}
        own |= {joint: line for joint, line in sorted(lines.items()) if line.root == root}
        members = [joint for joint in own if joint in used]
        driven = (joint for joint in members if not np.isnan(model.torques[joint]))
        free = next(driven, members[0])  # the first is the one that others follow
        turned = dict[int, Line]()
        for joint, line in own.items():  # by the angle of the free joint
            ratio = line.ratio / own[free].ratio
            turned[joint] = Line(free, ratio, line.offset - ratio * own[free].offset)
        kept |= {joint: turned[joint] for joint in turned if joint in used and joint != free}
        others = {joint: turned[joint] for joint in turned if joint not in used}
        aside += [model.joint_names[joint] for joint in others]
        if others:
            ranges[free] = _narrowed(model, free, others)
    return Followers(kept, ranges, _notes(model, used, aside))


def _lines(model: HandModel, used: set[int], name: str) -> dict[int, Line]:
    """Follow each rule to a joint that follows none, or to a constant."""
    rules = {rule.joint: rule for rule in model.joint_rules}
    if len(rules) < len(model.joint_rules):
        listed_twice = [rule.joint for rule in model.joint_rules]
        _refuse(model, {j for j in rules if listed_twice.count(j) > 1}, name, "follow two others")
    lines = dict[int, Line]()
    for joint in rules:
        line, passed = Line(joint, 1.0, 0.0), [joint]
        while line.root in rules:
            rule = rules[line.root]
            if not rule.is_linear:
                _refuse(model, {joint} & used and {joint, rule.leader}, name, "are on a curve")
                break
            line = Line(
                rule.leader if rule.ratio else -1, line.ratio * rule.ratio,
                line.offset + line.ratio * rule.offset,
            )  # fmt: skip
            if line.root in passed:
                _refuse(model, set(passed), name, "follow each other in a circle")
            passed.append(line.root)
        else:
            lines[joint] = line
    return lines


def _narrowed(model: HandModel, free: int, others: dict[int, Line]) -> tuple[float, float]:
    """Return the range of a free joint at which joints that are not the hand's are in theirs."""
    low, high = model.joint_ranges[free].tolist()
    for joint, line in others.items():
        ends = (model.joint_ranges[joint] - line.offset) / line.ratio
        low, high = np.fmax(low, ends.min()), np.fmin(high, ends.max())
    return float(low), float(high)


def _refuse_loops(model: HandModel, used: set[int], name: str) -> None:
    """Refuse what holds bodies or tendons together, where joints of the hand move them."""
    for kind, *bodies in model.loops:
        one, other = (
            {j for j, own in enumerate(model.raw.jnt_bodyid.tolist()) if own in path}
            for path in (path_of_body(model, body) for body in bodies)
        )
        _refuse(model, (one ^ other) & used, name, f"are in a loop that a {kind} closes")
    for tendon in model.tendons:
        if tendon.is_held and (used & set(tendon.joints) or not tendon.joints):
            joints = set(tendon.joints) or used
            _refuse(model, joints, name, f"are coupled by the length of tendon {tendon.name}")


def _refuse(model: HandModel, joints: set[int], name: str, why: str) -> None:
    if joints:
        named = [model.joint_names[j] or f"joint{j}" for j in sorted(joints - {-1})]
        raise InputError(
            f"{name}: joints {listed(named)} {why}; a hand's joints must be free or follow one "
            "other by offset + ratio * angle: write such a rule in its place, or remove it"
        )


def _notes(model: HandModel, used: set[int], aside: list[str]) -> tuple[str, ...]:
    notes = list[str]()
    if aside:
        notes.append(
            "joints that move no fingertip are drawn as the file starts, though they are coupled "
            f"with joints that do: {listed(aside)}"
        )
    tendons = [t.name for t in model.tendons if used & set(t.joints) or not t.joints]
    if tendons:
        notes.append(
            f"tendons are left out, as if joints had motors of their own: {listed(tendons)}"
        )
    return tuple(notes)
