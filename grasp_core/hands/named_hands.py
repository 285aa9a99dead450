"""Finds hands by their names."""

from collections.abc import Callable, Mapping
from functools import partial

from grasp_core.checked import shown, text
from grasp_core.errors import InputError
from grasp_core.hands.hand import Hand
from grasp_core.hands.tables.allegro import URDF_TIPS, allegro
from grasp_core.hands.tables.leap import leap

HANDS: Mapping[str, Callable[[], Hand]] = {
    "allegro": allegro,
    "allegro-urdf": partial(allegro, "allegro-urdf", URDF_TIPS),
    "leap": leap,
}
"""What makes each hand, by its name."""


def hand_names() -> tuple[str, ...]:
    """Return the names of the hands whose numbers are built in."""
    return tuple(HANDS)


def load_hand(name: str) -> Hand:
    """Return a hand whose numbers are built in.

    Args:
        name: "allegro", "allegro-urdf" (the same with fingertips as in the maker's URDF) or "leap";
            `scenes.load_hand` also reads files.

    Raises:
        InputError: There is no such hand.
    """
    if text(name, "name") not in HANDS:
        raise InputError(
            f"name must be that of a built-in hand, {' or '.join(HANDS)}, got {shown(name)}; "
            "scenes.load_hand(path, fingertips=...) reads files"
        )
    return HANDS[name]()
