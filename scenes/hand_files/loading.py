"""Loads a hand by name, from an MJCF or URDF file, or from the package `mujoco-menagerie`.

This is the only door to that package.
"""

import importlib
from collections.abc import Iterable
from functools import partial
from pathlib import Path
from typing import Any

from grasp_core.checked import path_of, several, text
from grasp_core.errors import InputError
from grasp_core.hands.hand import FEWEST_FINGERS, MOST_FINGERS, Hand
from grasp_core.hands.named_hands import HANDS
from grasp_core.hands.named_hands import load_hand as built_in_hand

ENDINGS = (".xml", ".mjcf", ".urdf")
MENAGERIE = "menagerie:"


def load_hand(hand: str | Path, fingertips: Iterable[str] = ()) -> Hand:
    """Load a hand by name or from a file.

    Args:
        hand: "allegro", "allegro-urdf" or "leap"; the path of an MJCF file (.xml, .mjcf) or a URDF
            file (.urdf); or "menagerie:NAME" for a model of the package `mujoco-menagerie`.
        fingertips: For a file, the name of a site, geom or body for each of three to five
            fingertips. A built-in hand has its own.

    Raises:
        InputError: The hand is unknown, or the file is refused; the message says what to do.
    """
    names = several(fingertips, partial(text, name="fingertips"), "fingertips", "names")
    if isinstance(hand, str) and hand in HANDS:
        if names:
            raise InputError(f"the built-in hand {hand} has its own fingertips; leave them out")
        return built_in_hand(hand)
    if isinstance(hand, str) and hand.startswith(MENAGERIE):
        path = _menagerie_path(hand[len(MENAGERIE) :])
    else:
        path = path_of(hand, "hand")
    if path.suffix.lower() not in ENDINGS:
        raise InputError(
            f"hand must be {', '.join(HANDS)}, {MENAGERIE}NAME, or a file that ends with "
            f"{', '.join(ENDINGS)}, got {str(hand)[:80]!r}"
        )
    if not FEWEST_FINGERS <= len(names) <= MOST_FINGERS:
        raise InputError(
            f"{path}: name {FEWEST_FINGERS} to {MOST_FINGERS} fingertips (sites, geoms or bodies "
            f"of the file), got {len(names)}"
        )
    building: Any = importlib.import_module("scenes.hand_files.building")  # loads MuJoCo
    return building.hand_from_file(path, names)


def _menagerie_path(name: str) -> Path:
    """Return the path of the own file of a model in Menagerie, which may be downloaded first."""
    try:
        menagerie: Any = importlib.import_module("mujoco_menagerie")
    except ImportError as error:
        raise InputError(
            f"menagerie:{name} needs the package mujoco-menagerie: pip install mujoco-menagerie, "
            "or give the path of a model's file"
        ) from error
    robot, _, file = name.partition("/")
    try:
        folder = Path(menagerie.get(robot).path())
    except (menagerie.MenagerieError, KeyError, OSError) as error:
        said = " ".join(str(error).split())[:200]
        raise InputError(f"menagerie:{name} cannot be loaded: {said}") from error
    folder = folder if folder.is_dir() else folder.parent
    hands = sorted(path.name for path in folder.glob("*.xml") if not path.name.startswith("scene"))
    chosen = file or next((each for each in hands if "right" in each), hands[0] if hands else "")
    if chosen not in hands:
        raise InputError(
            f"menagerie:{name}: the model has no file {chosen!r}, but {', '.join(hands) or 'none'}"
        )
    return folder / chosen
