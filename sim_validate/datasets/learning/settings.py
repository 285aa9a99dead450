"""What a dataset holds on request for learners: the table `[learning]` of a settings file."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, Literal, TypeAlias, cast, get_args

from grasp_core.checked import one_of, whole
from grasp_core.errors import InputError
from grasp_core.files.complaints import settings_of
from grasp_core.files.strict_json import shown
from grasp_core.hands.named_hands import hand_names, load_hand

TABLE = "learning"
"""Name of the table in a settings file."""
Figure: TypeAlias = Literal["closure", "least_squeeze"]
"""A group of figures that each grasp has on request."""
FIGURES: tuple[Figure, ...] = get_args(Figure)
LEAST_SQUEEZE: Figure = "least_squeeze"
MOST_VARIED = 100
"""Largest number of rows of one kind that are made from a grasp."""
CONTROLS = 5
"""Number of kinds of synthetic negative controls that a grasp has at most."""
OF_GRASPS = ("friction_below", "friction_near", "friction_above", "moved_out", "mass_near")
"""Settings that say how many rows of a kind are made from each grasp; also the kinds' names."""


@dataclass(frozen=True, slots=True)
class Learning:
    """What is added to the tables, and how many rows of each kind are made from a grasp.

    Raises:
        InputError: A number is out of range.
    """

    friction_below: int = 0
    """Rows per grasp with its contacts at a friction clearly below its critical one."""
    friction_near: int = 0
    """Rows per grasp at a friction within some percent of its critical one, on either side."""
    friction_above: int = 0
    """Rows per grasp at a friction clearly above its critical one."""
    moved_out: int = 0
    """Rows per grasp with contacts moved on their faces, each out of its region."""
    mass_near: int = 0
    """Rows per grasp that is executed with a mass near the one at which it is predicted to fail."""
    figures: tuple[Figure, ...] = ()
    """Groups of figures of each grasp; what each takes is in docs/datasets.md."""
    seeds: tuple[int, ...] = ()
    """Seeds by which objects are misplaced once more in executions, besides the execution's own."""
    synthetic: int = CONTROLS
    """Largest number of synthetic negative controls of each grasp, drawn from all that exist."""
    hand: str = ""
    """Built-in hand whose pose is looked for in each grasp in force closure; empty for none."""

    def __post_init__(self) -> None:
        for name in OF_GRASPS:
            whole(getattr(self, name), name, most=MOST_VARIED)
        whole(self.synthetic, "synthetic", most=CONTROLS)
        one_of(self.hand, ("", *hand_names()), "hand")
        for name in self.figures:
            one_of(name, FIGURES, "figures")
        for seed in self.seeds:
            whole(seed, "seeds")
        for name in ("figures", "seeds"):
            if len(set(getattr(self, name))) < len(getattr(self, name)):
                raise InputError(f"{name}: expected different items, got one of them twice")

    def groups(self, *, executed: bool) -> dict[str, int]:
        """Return the groups of columns that the tables have on request, with their sizes."""
        chosen = ["kinds", *self.figures]
        chosen += ["margins"] if executed else []
        sized = {"hand": len(load_hand(self.hand).joints)} if self.hand else {}
        return {**dict.fromkeys(chosen, 1), **sized}

    @property
    def executes(self) -> str:
        """Name of a setting that only executions have a use for; empty if there is none."""
        used = {
            "mass_near": self.mass_near, "seeds": self.seeds,
            "figures": LEAST_SQUEEZE in self.figures,
        }  # fmt: skip
        return next((name for name, value in used.items() if value), "")


def asked_learning(table: object) -> Learning:
    """Read the table `[learning]` of a settings file."""
    if not isinstance(table, Mapping):
        raise InputError(f"{TABLE}: expected a table of settings, got {shown(table)}")
    given = cast("Mapping[str, Any]", table)
    known = [each.name for each in fields(Learning)]
    if unknown := [name for name in given if name not in known]:
        raise InputError(
            f"{TABLE}: no setting is named {shown(unknown[0])}; choose from {', '.join(known)}"
        )
    return settings_of(Learning, given, [TABLE])


def learning_table(asked: Learning) -> dict[str, Any]:
    """Return every setting as the table that gives the same settings when it is read."""
    return {each.name: getattr(asked, each.name) for each in fields(asked)}
