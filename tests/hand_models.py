"""Writes hands of tables as MuJoCo models, by another route than the code under test."""

import numpy as np

from grasp_core.hands.hand import PALM


def numbers(values):
    return " ".join(repr(float(value)) for value in np.ravel(values))


def axes(rotation):
    """MJCF's `xyaxes`: the first two columns."""
    return numbers([*rotation[:, 0], *rotation[:, 1]])


def geom(name, shape):
    """A geom; only balls, capsules and boxes occur."""
    place = f'name="{name}" pos="{numbers(shape.position)}"'
    half = np.asarray(shape.half_sizes)
    if shape.radius == 0.0:
        return (f'<geom {place} type="box" size="{numbers(half)}" '
                f'xyaxes="{axes(shape.rotation)}"/>')  # fmt: skip
    if not half.any():
        return f'<geom {place} type="sphere" size="{numbers([shape.radius])}"/>'
    along = shape.rotation[:, int(np.argmax(half))]
    ends = np.concatenate(
        [shape.position - half.max() * along, shape.position + half.max() * along]
    )
    return (f'<geom name="{name}" type="capsule" fromto="{numbers(ends)}" '
            f'size="{numbers([shape.radius])}"/>')  # fmt: skip


def chain(finger):
    """Nested bodies of a finger, with a sphere or a mesh at its tip."""
    text = ""
    for link in reversed(finger.links):
        joint = link.joint
        is_last, is_block = link is finger.links[-1], finger.tip.corners is not None
        shapes = link.shapes[:-1] if is_last and is_block else link.shapes  # not a block's cover
        geoms = "".join(geom(f"{link.name}:{i}", s) for i, s in enumerate(shapes))
        if is_last and is_block:
            geoms += f'<geom name="{finger.name}_tip" type="mesh" mesh="{finger.name}_tip"/>'
        elif is_last:
            center = numbers(finger.tip.center)
            geoms += (f'<geom name="{finger.name}_tip" type="sphere" pos="{center}" '
                      f'size="{numbers([finger.tip.radius])}"/>')  # fmt: skip
        limit = joint.torque_limit_n_m
        torque = f'actuatorfrcrange="{-limit} {limit}"' if limit else ""
        text = (
            f'<body name="{link.name}" pos="{numbers(joint.position)}" '
            f'xyaxes="{axes(joint.rotation)}"><joint name="{joint.name}" type="hinge" '
            f'axis="{numbers(joint.axis)}" range="{joint.lowest} {joint.highest}" {torque}/>'
            f"{geoms}{text}</body>"
        )
    return text


def hand_mjcf(hand, asset="", objects=""):
    """The whole model; the palm hangs on a mocap body, so that it can be put anywhere."""
    palm = "".join(geom(f"{PALM}:{i}", s) for i, s in enumerate(hand.palm))
    asset += "".join(f'<mesh name="{f.name}_tip" vertex="{numbers(f.tip.corners)}"/>'
                     for f in hand.fingers if f.tip.corners is not None)  # fmt: skip
    pairs = "".join(f'<exclude body1="{a}" body2="{b}"/>' for a, b in hand.ignored_pairs)
    return (
        f'<mujoco><compiler angle="radian" autolimits="true"/>'
        f'<asset>{asset}</asset><worldbody><body name="{PALM}" mocap="true">{palm}'
        f"{''.join(map(chain, hand.fingers))}</body>{objects}</worldbody>"
        f"<contact>{pairs}</contact></mujoco>"
    )
