"""Loads a hand by name, or from an MJCF or URDF file."""

import importlib
from collections.abc import Iterable
from functools import partial
from pathlib import Path
from typing import Any

from grasp_core.errors import InputError, about
from grasp_core.hands.hand import FEWEST_FINGERS, MOST_FINGERS, Hand
from grasp_core.hands.hand import load_hand as built_in_hand
from grasp_core.kinds import path_of, several, value_of
from grasp_core.names import HANDS

ENDINGS = (".xml", ".mjcf", ".urdf")


def load_hand(hand: str | Path, fingertips: Iterable[str] = ()) -> Hand:
    """Load a hand by name or from a file.

    Args:
        hand: "allegro", "allegro-urdf" or "leap"; or the path of an MJCF file (.xml, .mjcf) or a
            URDF file (.urdf).
        fingertips: For a file, the name of a site, geom or body for each of three to five
            fingertips. A built-in hand has its own.

    Raises:
        InputError: The hand is unknown, or the file is refused; the message says what to do.
    """
    names = several(fingertips, partial(value_of, str, name="fingertips"), "fingertips", "names")
    if isinstance(hand, str) and hand in HANDS:
        if names:
            raise InputError(f"the built-in hand {hand} has its own fingertips; leave them out")
        return built_in_hand(hand)
    path = path_of(hand, "hand")
    if path.suffix.lower() not in ENDINGS:
        raise InputError(
            f"hand must be {', '.join(HANDS)}, or a file that ends with {', '.join(ENDINGS)}, got "
            f"{str(hand)[:80]!r}"
        )
    if not FEWEST_FINGERS <= len(names) <= MOST_FINGERS:
        raise InputError(
            f"{path}: name {FEWEST_FINGERS} to {MOST_FINGERS} fingertips (sites, geoms or bodies "
            f"of the file), got {len(names)}"
        )
    building: Any = importlib.import_module("scenes.hand_files.building")  # loads MuJoCo
    with about(path):
        return building.hand_from_file(path, names)
