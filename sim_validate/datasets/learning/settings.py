"""What a dataset holds on request for learners: the table `[learning]` of a settings file."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, Literal, TypeAlias, cast, get_args

from grasp_core.checked import one_of, positive, whole
from grasp_core.errors import InputError
from grasp_core.files.json_text import settings_of, shown
from grasp_core.hands.named_hands import hand_names, load_hand
from grasp_core.objects.polyhedron import UNITS_M

TABLE = "learning"
"""Name of the table in a settings file."""
Figure: TypeAlias = Literal["closure", "symmetry", "approach", "payload", "least_squeeze"]
"""A group of figures that each grasp has on request."""
FIGURES: tuple[Figure, ...] = get_args(Figure)
LEAST_SQUEEZE: Figure = "least_squeeze"
SplitBy: TypeAlias = Literal["hash", "object", "class"]
SPLITS_BY: tuple[SplitBy, ...] = get_args(SplitBy)
BY_NAME = ("units", "scales", "classes")
"""Tables with a value for each of some objects."""
MOST_POINTS = 100_000
"""Largest number of points on an object."""
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
    rests: bool = False
    """Whether there is a table of resting poses."""
    points: int = 0
    """Number of points, with normals, that are drawn on each object's surface; 0 for none."""
    split_by: SplitBy = "hash"
    """Whether splits follow from each object's hash, or are counted by object or by class."""
    units_in_names: bool = False
    """Whether file names tell their unit, as in `bracket.mm.stl`."""
    units: dict[str, str] = field(default_factory=dict[str, str])
    """Length of one unit in a mesh file, by the file's name; others have that of the dataset."""
    scales: dict[str, float] = field(default_factory=dict[str, float])
    """Factor by which an object is scaled besides, by its name or its file's; other files have that
    of the dataset."""
    classes: dict[str, str] = field(default_factory=dict[str, str])
    """Class of an object's shape, by its name or its file's; others get one by their geometry."""
    synthetic: int = CONTROLS
    """Largest number of synthetic negative controls of each grasp, drawn from all that exist."""
    hand: str = ""
    """Built-in hand whose pose is looked for in each grasp in force closure; empty for none."""

    def __post_init__(self) -> None:
        for name in OF_GRASPS:
            whole(getattr(self, name), name, most=MOST_VARIED)
        whole(self.synthetic, "synthetic", most=CONTROLS)
        whole(self.points, "points", most=MOST_POINTS)
        one_of(self.split_by, SPLITS_BY, "split_by")
        one_of(self.hand, ("", *hand_names()), "hand")
        for unit in self.units.values():
            one_of(unit, tuple(UNITS_M), "units")
        for scale in self.scales.values():
            positive(scale, "scales")
        for name in self.figures:
            one_of(name, FIGURES, "figures")
        for seed in self.seeds:
            whole(seed, "seeds")
        for name in ("figures", "seeds"):
            if len(set(getattr(self, name))) < len(getattr(self, name)):
                raise InputError(f"{name}: expected different items, got one of them twice")

    def groups(self, *, executed: bool) -> dict[str, int]:
        """Return the groups of columns that the tables have on request, with their sizes."""
        chosen = ["kinds", "shape", *self.figures]
        chosen += ["margins"] if executed else []
        chosen += ["units"] if self.has_units else []
        chosen += ["rests"] if self.rests else []
        sized = {"points": self.points} if self.points else {}
        if self.hand:
            sized["hand"] = len(load_hand(self.hand).joints)
        return {**dict.fromkeys(chosen, 1), **sized}

    @property
    def has_units(self) -> bool:
        """Whether objects have units and scales of their own."""
        return bool(self.units or self.scales or self.units_in_names)

    def unit_of(self, name: str, usual: str) -> str:
        """Return the unit of an object's mesh file: of the table, of its name, or the usual one."""
        path = Path(name)
        in_name = path.with_suffix("").suffix[1:] if self.units_in_names else ""
        return self.units.get(path.name, in_name if in_name in UNITS_M else usual)

    def scale_of(self, name: str, usual: float = 1.0) -> float:
        """Return the factor by which an object is scaled: of the table, or the usual one."""
        return self.scales.get(Path(name).name, usual)

    def of_object(self, name: str, scale: float) -> "Learning":
        """Return the settings of one object, whose size does not grow with the number of all."""
        own = Path(name).name
        kept = {
            table: {key: value for key, value in getattr(self, table).items() if key == own}
            for table in BY_NAME
        }
        if self.has_units:  # so that all units of work have the same columns
            kept["scales"] = {own: scale}
        return replace(self, **kept)

    def check_names(self, names: Sequence[str]) -> None:
        """Refuse tables about objects that are not there."""
        for table in BY_NAME:
            if unknown := [name for name in getattr(self, table) if name not in names]:
                raise InputError(
                    f"{TABLE}.{table}: no object or mesh file is named {shown(unknown[0])}"
                )

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
