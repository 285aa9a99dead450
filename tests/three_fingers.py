"""The gripper with three fingers that docs/own-hand.md shows, for tests of several rooms."""

import re
from pathlib import Path

PAGE = Path(__file__).parent.parent / "docs" / "own-hand.md"
THREE_TIPS = ("thumb_tip", "left_tip", "right_tip")


def coupled_fingers_mjcf():
    """The gripper as the page has it, whose fingers curl as they bend."""
    (text,) = re.findall(r"```xml\n(.*?)```", PAGE.read_text(), re.DOTALL)
    return text


def three_fingers_mjcf():
    """The gripper with a motor for each joint."""
    rules = r"  <equality>.*</equality>\n"
    text, count = re.subn(rules, "", coupled_fingers_mjcf(), flags=re.DOTALL)
    assert count == 1
    return text


def three_fingers_file(folder):
    """Write the gripper to a folder and return its path as text."""
    path = folder / "three_fingers.xml"
    path.write_text(three_fingers_mjcf())
    return str(path)
