"""Finds palm, fingers, fingertips and coupled joints of a compiled model from fingertips' names.

The palm is the last body that all fingertips hang on. Each body below it belongs to the link of the
nearest joint on the way to a fingertip; what hangs on no such way, and what is above the palm,
stays where the model's reference pose has it, fixed to the link or palm that carries it.

A fingertip that is a site or a sphere is the ball itself. A capsule gives the ball at the end that
is farther from the last joint. Any other geom is a block: a mesh the hull of its corners, anything
else its box. A block has sharp edges, so that its corners are given a rounding, by which it is
larger all around. The ball that stands for it lies in its box, at the end that is farther from the
last joint.

Rules that hold a joint at a linear function of another (`<mimic>` of URDF, `<equality><joint>` of
MJCF, `<equality><tendon>` of a sum of two joints) are followed to a joint that follows none. Of
joints that move together one is the hand's free joint: that one, if it is on the way to a fingertip
and has a motor or no other has; otherwise the first with a motor, or the first. Joints off the way
to a fingertip count by their ranges. Two joints that a tendon keeps within a few degrees of each
other, of which one has no motor, are coupled in the middle of that play. Other rules are refused.
"""

import importlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any, TypeAlias

import numpy as np

from grasp_core.arrays import Array
from grasp_core.errors import InputError
from grasp_core.hands.collisions import beyond_hull
from grasp_core.hands.hand import FILE_DIGITS, Coupling, Fingertip, LinkShape
from grasp_core.messages import shown
from scenes.hand_files.model import TIED, HandModel, JointRule, Tendon, mesh_points
from scenes.hand_files.model_text import listed, note

WORLD = 0
ACROSS = {0: (1, 2), 1: (0, 2), 2: (0, 1)}
CORNER_SIGNS = np.array(list(product((-1.0, 1.0), repeat=3)))
LEAST_BLOCK_ROUNDING = 1e-4
"""Least rounding of a block [m]."""
MOST_PLAY_RAD = 0.35
"""Largest play that a tendon of two joints leaves to one of them, for them to count as coupled."""
MOST_WAYS = 180
"""Number of directions in which the corners of a mesh are taken that has more of them."""


Frame: TypeAlias = tuple[Array, Array]
"""Axes of a link as columns, (3, 3), and its origin, (3,) [m], in the world."""


@dataclass(frozen=True, slots=True)
class Tip:
    """What a name of a fingertip stands for."""

    name: str
    body: int
    geom: int | None  # its geom; None for a site
    site: int | None


@dataclass(frozen=True, slots=True)
class FingerChains:
    """Joints of fingers, and to which link each body is fixed."""

    palm: int  # the palm's body
    tips: tuple[Tip, ...]
    joints: tuple[tuple[int, ...], ...]
    """For each finger its joints, from the palm outwards; the first may be common."""
    owners: tuple[int, ...]
    """For each body, the joint that moves it, -1 for the palm's, -2 where it is no part of it."""
    frames: dict[int, Frame]
    """Frame of each joint's link, with the axes of its body; -1 is the palm's."""


def finger_chains(model: HandModel, fingertips: tuple[str, ...]) -> FingerChains:
    """Find the palm and the fingers."""
    tips = tuple(_tip(model, each) for each in fingertips)
    paths = [path_of_body(model, tip.body) for tip in tips]
    shared = 0
    while all(len(p) > shared for p in paths) and len({p[shared] for p in paths}) == 1:
        shared += 1
    palm = paths[0][shared - 1]
    found = [tuple(_joints_of(model, body) for body in p[shared:]) for p in paths]
    joints = tuple(tuple(j for part in parts for j in part) for parts in found)
    for tip, chain in zip(tips, joints, strict=True):
        if not chain:
            raise InputError(
                f"no joint moves {tip.name} against the others; name one fingertip for each finger"
            )
        for joint in chain:
            if model.joint_kinds[joint] != "hinge":
                raise InputError(
                    f"joint {model.joint_names[joint]} of the finger to {tip.name} "
                    f"must be a hinge, got {model.joint_kinds[joint]}"
                )
    for tip, chain in zip(tips, joints, strict=True):
        if sum(chain[-1] in other for other in joints) > 1:
            raise InputError(
                f"fingers may share some joints, but must end with one of their own; "
                f"{model.joint_names[chain[-1]]} moves {tip.name} and another fingertip"
            )
    frames = {-1: (model.rotations[palm], model.positions[palm])}
    for joint in (joint for chain in joints for joint in chain):
        body = int(model.raw.jnt_bodyid[joint])
        R = model.rotations[body]
        frames[joint] = R, model.positions[body] + R @ model.raw.jnt_pos[joint]
    return FingerChains(palm, tips, joints, _owners(model, palm, set(frames)), frames)


def _tip(model: HandModel, name: str) -> Tip:
    """Find what a name stands for: a site, else a geom, else a body."""
    if name and name in model.site_names:
        site = model.site_names.index(name)
        return Tip(name, int(model.raw.site_bodyid[site]), None, site)
    if name and name in model.geom_names:
        geom = model.geom_names.index(name)
        return Tip(name, int(model.raw.geom_bodyid[geom]), geom, None)
    if name and name in model.body_names:
        body = model.body_names.index(name)
        own = [g for g in _solid(model) if model.raw.geom_bodyid[g] == body]
        balls = [g for g in own if model.geom_kinds[g] in {"sphere", "capsule"}]
        geom = (balls or own)[-1] if own else _nearest(model, body, name)
        return Tip(name, int(model.raw.geom_bodyid[geom]), geom, None)
    known = [each for each in (*model.site_names, *model.geom_names, *model.body_names) if each]
    raise InputError(
        f"there is no site, geom or body {shown(name)}; fingertips are named by these, "
        f"such as {', '.join(known[-12:])}"
    )


def _nearest(model: HandModel, body: int, name: str) -> int:
    """Return the geom of a link whose box is nearest to a body of the link that has no geom."""
    links = _owners(model, WORLD, set(range(len(model.raw.jnt_bodyid))))
    own = [g for g in _solid(model) if links[int(model.raw.geom_bodyid[g])] == links[body]]
    if not own:
        raise InputError(
            f"fingertip {shown(name)} and the link that it is on have no shape; give "
            "it one, such as a sphere of the fingertip's radius"
        )

    def away(g: int) -> float:
        R, p = model.rotations[model.raw.geom_bodyid[g]], model.positions[model.raw.geom_bodyid[g]]
        local = R.T @ (model.positions[body] - p) - model.raw.geom_pos[g]
        off = np.abs(model.geom_rotations[g].T @ local - model.raw.geom_aabb[g, :3])
        return float(np.linalg.norm(np.maximum(off - model.raw.geom_aabb[g, 3:], 0.0)))

    return min(own, key=away)


def _solid(model: HandModel) -> list[int]:
    return [
        g for g, bits in enumerate(model.geom_bits)
        if bits.any() and model.geom_kinds[g] not in {"plane", "hfield"}
    ]  # fmt: skip


def path_of_body(model: HandModel, body: int) -> list[int]:
    """Return the bodies from the world to one."""
    path = [body]
    while path[-1] != WORLD:
        path.append(int(model.raw.body_parentid[path[-1]]))
    return path[::-1]


def _joints_of(model: HandModel, body: int) -> tuple[int, ...]:
    return tuple(int(j) for j in np.flatnonzero(model.raw.jnt_bodyid == body))


def _owners(model: HandModel, palm: int, used: set[int]) -> tuple[int, ...]:
    found = list[int]()
    for body in range(len(model.raw.body_parentid)):
        moving = [j for b in path_of_body(model, body) for j in _joints_of(model, b) if j in used]
        apart = body == WORLD and palm != WORLD  # the floor is no part of a hand
        found.append(-2 if apart else moving[-1] if moving else -1)
    return tuple(found)


def tip_of(model: HandModel, tip: Tip, frame: Frame) -> tuple[Fingertip, LinkShape | None]:
    """Make a fingertip in the frame of its link.

    Gives also the box that covers a block, in place of its geom and in the frame of its body.
    """
    axes, origin = frame
    R, p = model.rotations[tip.body], model.positions[tip.body]

    def ball(center: Array, radius: float, corners: Array | None = None) -> Fingertip:
        placed = axes.T @ (p + R @ center - origin)
        if corners is None:
            return Fingertip(placed, radius)
        return Fingertip(placed, radius, (p + corners @ R.T - origin) @ axes, rounding)

    if tip.site is not None:
        radius = float(model.raw.site_size[tip.site, 0])
        if radius <= 0.0:
            raise InputError(f"site {tip.name} must have a size, the ball's radius")
        return ball(model.raw.site_pos[tip.site], radius), None
    geom, joint = int(tip.geom or 0), R.T @ (origin - p)
    place, turned = model.raw.geom_pos[geom], model.geom_rotations[geom]
    kind = model.geom_kinds[geom]
    if kind == "sphere":
        return ball(place, float(model.raw.geom_size[geom, 0])), None
    middle = place + turned @ model.raw.geom_aabb[geom, :3]
    half = model.raw.geom_aabb[geom, 3:].copy()
    if kind == "capsule":
        axis, radius = 2, float(model.raw.geom_size[geom, 0])
    else:
        axis = int(np.argmax(np.abs(turned.T @ (middle - joint))))
        radius = float(half[list(ACROSS[axis])].min())
        half[axis] = max(half[axis], radius)
    sign = 1.0 if turned[:, axis] @ (middle - joint) >= 0.0 else -1.0
    center = middle + sign * (half[axis] - radius) * turned[:, axis]
    if kind == "capsule":
        return ball(center, radius), None
    corners, rounding = _corners(model, geom)
    low, high = corners.min(axis=0) - rounding, corners.max(axis=0) + rounding
    covered = 0.5 * (high - low) + FILE_DIGITS
    cover = LinkShape(place + turned @ (0.5 * (low + high)), turned, covered, 0.0)
    return ball(center, radius, place + corners @ turned.T), cover


def _corners(model: HandModel, geom: int) -> tuple[Array, float]:
    """Return corners in a geom's frame, (m, 3), whose hull, less a rounding, holds the geom."""
    box, points = model.raw.geom_aabb[geom], mesh_points(model, geom)
    if len(points) == 0:
        return box[:3] + CORNER_SIGNS * box[3:], LEAST_BLOCK_ROUNDING
    spatial: Any = importlib.import_module("scipy.spatial")
    points = points[spatial.ConvexHull(points, qhull_options="QJ Pp").vertices]
    if len(points) <= MOST_WAYS:
        return points, LEAST_BLOCK_ROUNDING
    ways = np.random.default_rng(0).normal(size=(MOST_WAYS, 3))
    kept = points[np.unique(np.argmax(points @ ways.T, axis=0))]
    return kept, LEAST_BLOCK_ROUNDING + max(beyond_hull(kept, points))


def followers(
    model: HandModel, found: FingerChains
) -> tuple[tuple[Coupling, ...], Array, tuple[str, ...]]:
    """Find which joints follow others: couplings on the way to fingertips, ranges, and notes.

    Ranges are those of all joints, (j, 2) [rad], narrowed by what follows them; NaN for none.
    """
    used = {joint for chain in found.joints for joint in chain}
    _refuse_loops(model, used)
    ties = list(_ties(model, used))
    lines = _lines([*model.joint_rules, *(rule for _, rule in ties)], model, used)
    roots = {rule.leader for joint, rule in lines.items() if joint in used and rule.leader >= 0}
    kept = list[JointRule]()
    ranges = model.joint_ranges.copy()
    for joint in used & lines.keys():
        if (constant := lines[joint]).leader < 0:
            ranges[joint] = constant.offset
    aside = list[str]()
    for root in sorted(roots):
        own = [JointRule(root, root, 0.0, 1.0)]
        own += [rule for _, rule in sorted(lines.items()) if rule.leader == root]
        members = [rule for rule in own if rule.joint in used]
        driven = (rule for rule in members if not np.isnan(model.torques[rule.joint]))
        free = next(driven, members[0])  # the first is the one that others follow
        turned = list[JointRule]()
        for rule in own:  # by the angle of the free joint
            ratio = rule.ratio / free.ratio
            offset = rule.offset - ratio * free.offset
            turned.append(JointRule(rule.joint, free.joint, offset, ratio))
        kept += [rule for rule in turned if rule.joint in used and rule.joint != free.joint]
        if others := [rule for rule in turned if rule.joint not in used]:
            aside += [model.joint_names[rule.joint] for rule in others]
            for rule in others:  # which are not the hand's, and stay in their ranges
                ends = (model.joint_ranges[rule.joint] - rule.offset) / rule.ratio
                low, high = ranges[free.joint]
                ranges[free.joint] = np.fmax(low, ends.min()), np.fmin(high, ends.max())
    couplings = tuple(
        Coupling(joint_name(model, rule.joint), joint_name(model, rule.leader), rule.ratio,
                 rule.offset)
        for rule in sorted(kept)
    )  # fmt: skip
    drawn = "joints that move no fingertip are drawn as the file starts, though they are coupled"
    tendons = [t for t in model.tendons if used & set(t.joints) or not t.joints]
    held = "joints that tendons keep together within some degrees follow each other, without play"
    known = {*(t.name for t, _ in ties), *(t.name for t in tendons if t.motors)}
    notes = (
        *note(f"{drawn} with joints that do", aside),
        *note(held, [t.name for t, _ in ties]),
        *note("tendons that no motor pulls are left out", [t.name for t in tendons if t.name not in
                                                          known]),
    )  # fmt: skip
    return couplings, ranges, notes


def shared_motors(model: HandModel, found: FingerChains) -> tuple[str, ...]:
    """Say of each motor that pulls a tendon of the fingers' joints, or a cable, what it turns."""
    used = {joint for chain in found.joints for joint in chain}
    return tuple(
        f"one motor pulls tendon {tendon.name}, "
        + (f"which turns {listed([joint_name(model, joint) for joint in tendon.joints])}"
           if tendon.joints else "a cable")
        for tendon in model.tendons
        if tendon.motors and (used & set(tendon.joints) or not tendon.joints)
    )  # fmt: skip


def _ties(model: HandModel, used: set[int]) -> Iterator[tuple[Tendon, JointRule]]:
    """Yield tendons that keep two joints together, and the rule in the middle of their play.

    The joint without a motor follows the other, or the second where neither has one.
    """
    ruled = {rule.joint for rule in model.joint_rules}
    for tendon in model.tendons:
        if tendon.lengths is None or tendon.motors or len(tendon.joints) != TIED:
            continue
        ends = list(zip(tendon.joints, tendon.factors, strict=True))
        ends.sort(key=lambda end: not np.isnan(model.torques[end[0]]))
        (joint, factor), (leader, other) = ends
        low, high = tendon.lengths
        single = np.isnan(model.torques[joint]) and joint not in ruled and {joint, leader} & used
        if single and high - low <= MOST_PLAY_RAD * abs(factor):
            middle = 0.5 * (low + high) / factor
            yield tendon, JointRule(joint, leader, middle, -other / factor)


def _lines(
    every: Sequence[JointRule], model: HandModel, used: set[int]
) -> dict[int, JointRule]:  # fmt: skip
    """Follow each rule to a joint that follows none, or to a constant."""
    rules = {rule.joint: rule for rule in every}
    if len(rules) < len(every):
        listed_twice = [rule.joint for rule in every]
        _refuse(model, {j for j in rules if listed_twice.count(j) > 1}, "follow two others")
    lines = dict[int, JointRule]()
    for joint in rules:
        line, passed = JointRule(joint, joint, 0.0, 1.0), [joint]
        while line.leader in rules:
            rule = rules[line.leader]
            if not rule.is_linear:
                _refuse(model, {joint} & used and {joint, rule.leader}, "are on a curve")
                break
            offset = line.offset + line.ratio * rule.offset
            leader = rule.leader if rule.ratio else -1
            line = JointRule(joint, leader, offset, line.ratio * rule.ratio)
            if leader in passed:
                _refuse(model, set(passed), "follow each other in a circle")
            passed.append(leader)
        else:
            lines[joint] = line
    return lines


def joint_name(model: HandModel, joint: int) -> str:
    """Name a joint, also where the file does not."""
    return model.joint_names[joint] or f"joint{joint}"


def _refuse_loops(model: HandModel, used: set[int]) -> None:
    """Refuse what holds bodies or tendons together, where joints of the hand move them."""
    for kind, *bodies in model.loops:
        one, other = (
            {j for j, own in enumerate(model.raw.jnt_bodyid.tolist()) if own in path}
            for path in (path_of_body(model, body) for body in bodies)
        )
        _refuse(model, (one ^ other) & used, f"are in a loop that a {kind} closes")
    for tendon in model.tendons:
        if tendon.is_held and (used & set(tendon.joints) or not tendon.joints):
            joints = set(tendon.joints) or used
            _refuse(model, joints, f"are coupled by the length of tendon {tendon.name}")


def _refuse(model: HandModel, joints: set[int], why: str) -> None:
    if joints:
        named = [joint_name(model, joint) for joint in sorted(joints - {-1})]
        raise InputError(
            f"joints {listed(named)} {why}; a hand's joints must be free or follow one "
            "other by offset + ratio * angle: write such a rule in its place, or remove it"
        )
