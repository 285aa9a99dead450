"""Leaves out of a hand's text what says nothing about the hand, or what MuJoCo would refuse.

Attributes of MuJoCo 2 and 3 that MuJoCo's changelog lists as removed are left out. Files of hands
that were cut out of whole robots still have motors, tendons and contacts of parts that are gone;
these are left out too.
"""

import re
from typing import Any

UNUSED = {
    "sensor", "keyframe", "custom", "texture", "layer", "skin", "camera", "light",
    "gazebo", "transmission", "ros2_control",
}  # fmt: skip
"""Elements of MJCF and URDF that are about other things than the hand's shape, joints and motors,
and may name or hold anything."""
OBSOLETE = {
    "compiler": ("convexhull", "exactmeshinertia"),
    "option": ("apirate", "collision", "mpr_iterations", "mpr_tolerance"),
    "flag": ("passive", "sensornoise"),
    "joint": ("actuatorforcelimited", "actuatorforcerange"),
}
PART = re.compile(r"(?:side|crank|slider|ref)?(joint|body|geom|site|tendon)(?:inparent|1|2)?")
"""Attributes of tendons, contacts and motors that name a part of the model, and which kind."""


def without_unused(root: Any) -> list[str]:
    """Leave these elements and attributes out of a model's text; return what is obsolete."""
    old = list[str]()
    for element in list(root.iter()):
        element[:] = [each for each in element if each.tag not in UNUSED]
        if element.tag == "material":
            element.attrib.pop("texture", None)
        for key in OBSOLETE.get(element.tag, ()):
            if element.attrib.pop(key, None) is not None:
                old.append(key)
    return list(dict.fromkeys(old))


def without_missing(root: Any) -> list[str]:
    """Leave out motors, tendons and contacts of missing parts; return what they are called."""
    known = {("body", "world")}
    for each in root.iterfind("worldbody//*"):
        known.add(("joint" if each.tag == "freejoint" else each.tag, each.get("name")))
    lost = list[str]()
    for section in ("tendon", "contact", "actuator"):
        for parent in root.findall(section):
            for element in list(parent):
                named = [pair for each in element.iter() for pair in each.attrib.items()]
                if missing := [
                    name for key, name in named
                    if (part := PART.fullmatch(key)) and (part[1], name) not in known
                ]:  # fmt: skip
                    parent.remove(element)
                    lost.append(element.get("name") or f"{element.tag} of {missing[0]}")
                elif section == "tendon":  # which motors may pull
                    known.add((section, element.get("name")))
    return lost
