"""The gripper with three fingers that docs/hands.md shows, for tests of several rooms."""

import re
from pathlib import Path

PAGE = Path(__file__).parent.parent / "docs" / "hands.md"
THREE_TIPS = ("thumb_tip", "left_tip", "right_tip")


def three_fingers_mjcf():
    (text,) = re.findall(r"```xml\n(.*?)```", PAGE.read_text(), re.DOTALL)
    return text


def three_fingers_file(folder):
    """Write the gripper to a folder and return its path as text."""
    path = folder / "three_fingers.xml"
    path.write_text(three_fingers_mjcf())
    return str(path)
