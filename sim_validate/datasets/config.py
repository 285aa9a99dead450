"""Reads and checks the configuration of a dataset, from a TOML file or flags; writes it as TOML.

Everything that decides a row is here. So the hash of the resolved text, together with the hashes of
the meshes and the versions, identifies what a dataset can hold.
"""

from collections import Counter
from collections.abc import Mapping
from dataclasses import KW_ONLY
from datetime import date
from pathlib import Path
from typing import Annotated, Literal, TypeAlias, cast, get_args

from annotated_types import Interval

from grasp_core.allowed_values import Count, Friction, Number, RandomWrenches
from grasp_core.declared import declared
from grasp_core.errors import InputError, about
from grasp_core.mesh_files.limits import FaceKind, FileLengths
from grasp_core.messages import shown
from grasp_core.names import HANDS, METHODS, ConeKind, Method
from grasp_core.settings import Settings, as_table
from sim_validate.files.toml_files import quoted
from sim_validate.settings import ExecutionSettings, HandTrials, LimitSearch

TableName: TypeAlias = Literal["objects", "grasps", "trials", "executions"]
TABLE_NAMES: tuple[TableName, ...] = get_args(TableName)
SplitName: TypeAlias = Literal["train", "validation", "test"]
SPLITS: tuple[tuple[SplitName, float], ...] = (("test", 0.1), ("validation", 0.2), ("train", 1.0))
"""Upper ends of each split's share of hashes: an object is in the first split whose end is above
its hash."""
ID_DIGITS = 16
"""Number of digits of an object's hash in the names of its grasps."""
KEYS: Mapping[TableName, tuple[str, ...]] = {
    "objects": ("object_id",), "grasps": ("object_id", "grasp_id"), "trials": ("grasp_id", "trial"),
    "executions": ("grasp_id", "trial"),
}  # fmt: skip
"""Columns by which the rows of a table are sorted; no two rows have the same values in them."""
REFERENCES: Mapping[tuple[TableName, str], tuple[TableName, str]] = {
    ("grasps", "object_id"): ("objects", "object_id"),
    ("trials", "grasp_id"): ("grasps", "grasp_id"),
    ("executions", "grasp_id"): ("grasps", "grasp_id"),
}
"""Columns whose cells name a row of another table, with the column there that holds the name."""
EXECUTED = "executed"
"""The group of columns of a dataset with executions, which has one table more."""


def id_beginning(object_id: str, friction: float) -> str:
    """Return the first part of the names of all grasps of one object at one friction."""
    return f"{object_id[:ID_DIGITS]}-{friction}-"


EXECUTING = "execution"
LEARNING = "learning"
HAND = "hand"
"""The table of settings about a hand, and the group of columns with what it does."""
FigureGroup: TypeAlias = Literal["closure", "least_squeeze", "placement"]
CONTROL_KINDS = 5
"""Number of kinds of synthetic negative controls that a grasp has at most."""
CREDITS = ("title", "license", "creator", "url", "published")
"""Settings that only inform people; no row depends on them."""
RowsPerGrasp = Annotated[int, Interval(ge=0, le=100)]


@declared
class Learning(Settings):
    """What is added to the tables, and how many rows of each kind are made from a grasp."""

    friction_below: RowsPerGrasp = 0
    """Rows per grasp with its contacts clearly below their critical friction."""
    friction_near: RowsPerGrasp = 0
    """Rows per grasp within some percent of the critical friction, on either side."""
    friction_above: RowsPerGrasp = 0
    """Rows per grasp clearly above the critical friction."""
    moved_out: RowsPerGrasp = 0
    """Rows per grasp with contacts moved on their faces, each out of its region."""
    mass_near: RowsPerGrasp = 0
    """Rows per grasp that is executed with a mass near the one at which it is predicted to fail."""
    figures: tuple[FigureGroup, ...] = ()
    """Groups of figures that each grasp has; docs/datasets.md says what each costs."""
    seeds: tuple[Number, ...] = ()
    """Seeds by which objects are misplaced once more in executions, besides the execution's own."""
    synthetic: Annotated[int, Interval(ge=0, le=CONTROL_KINDS)] = CONTROL_KINDS
    """Largest number of synthetic negative controls of each grasp, drawn from all that exist."""

    def _check_together(self) -> None:
        for name in ("figures", "seeds"):
            if len(set(getattr(self, name))) < len(getattr(self, name)):
                raise InputError(f"{name}: expected different items, got one of them twice")

    def groups(self, *, executed: bool) -> dict[str, int]:
        """Return the groups of columns that the tables have on request, with their sizes."""
        chosen = ["kinds", *self.figures]
        chosen += ["margins"] if executed else []
        return dict.fromkeys(chosen, 1)

    @property
    def executes(self) -> str:
        """Name of a setting that only executions have a use for; empty if there is none."""
        least = "least_squeeze" in self.figures
        used = {"mass_near": self.mass_near, "seeds": self.seeds, "figures": least}
        return next((name for name, value in used.items() if value), "")


@declared
class DatasetHand(HandTrials):
    """The hand whose pose is looked for in each grasp in force closure, and what it does there."""

    hand: str = ""
    """Hand whose pose is looked for in each grasp in force closure: `allegro`, `allegro-urdf`,
    `leap`, or an MJCF or URDF file; none if empty."""
    fingertips: tuple[str, ...] = ()
    """For a hand from a file: names of sites, geoms or bodies that are fingertips."""

    def _check_together(self) -> None:
        HandTrials._check_together(self)
        if self.hand in HANDS and self.fingertips:
            raise InputError(f"fingertips: the built-in hand {self.hand} has its own; remove them")


@declared
class Content(FileLengths):
    """What a dataset is made of, whether its grasps are planned or given."""

    frictions: tuple[Friction, ...] = (0.5,)
    """Coulomb coefficients at each of which grasps are planned and simulated."""
    faces: FaceKind = "auto"
    """Faces to plan on: exact planar faces, or nearly flat patches of a curved or scanned surface.
    """
    limits: LimitSearch = "none"
    """Also find the largest multiple of each wrench in simulation."""
    random_wrenches: RandomWrenches = 0
    """Number of random wrenches that each grasp must hold as well."""
    seed: Annotated[int, Interval(ge=0, le=2**63 - 1)] = 0
    """Seed of all random choices."""
    scenes: bool = False
    """Also write each grasp as a MuJoCo scene."""
    title: str = "four-finger grasps"
    """Title of the dataset, for its README.md, as the settings below; no row depends on them."""
    license: str = ""
    """License of the dataset, such as CC-BY-4.0."""
    creator: str = ""
    """Who makes the dataset."""
    url: str = ""
    """Web address at which the dataset will be found."""
    published: str = ""
    """Date of publication, such as 2026-11-22, as a clock would make every build differ."""


@declared
class PlannedContent(Content):
    """What a dataset of planned grasps is made of."""

    families: tuple[Method, ...] = METHODS
    """Families of grasps to construct."""
    limit: Count = 20
    """Largest number of grasps of each object, friction and family."""
    cones: ConeKind = "tilted"
    """Axes of the force cones that grasps are constructed with: only the face normals, or tilted
    ones too."""


@declared
class DatasetConfig(PlannedContent):
    """Settings of a dataset: objects, frictions, families, and how grasps are planned and tried."""

    _: KW_ONLY
    objects: tuple[str, ...]
    """Mesh files, or names of built-in objects."""
    contacts: str = ""
    """Path of a file of contacts on the one object, which are judged instead of planned ones; empty
    to plan."""
    outward: bool = False
    """Whether normals in that file point out of the object."""
    execution: ExecutionSettings | None = None
    """How grasps are executed besides: with true mass and springy fingers; None to leave it out."""
    learning: Learning | None = None
    """What the tables hold besides for learners; None for nothing."""
    hand: DatasetHand | None = None
    """The hand that looks for poses in grasps, and what it does there; None for none."""

    def _check_together(self) -> None:
        for name in ("objects", "frictions", "families"):
            values: tuple[object, ...] = getattr(self, name)
            twice = [value for value, count in Counter(values).items() if count > 1]
            if not values or twice:
                got = f"{shown(twice[0])} twice" if twice else "none"
                raise InputError(
                    f"{name}: expected a list of one or more different items, got {got}"
                )
        if self.contacts and len(self.objects) > 1:
            raise InputError(
                "objects: expected only one object beside `contacts`, the one that the contacts "
                "are on"
            )
        if self.learning is not None and self.learning.executes and self.execution is None:
            raise InputError(
                f"{LEARNING}.{self.learning.executes}: only executed grasps have a mass and a "
                f"squeeze; add a table [{EXECUTING}], or leave this setting out"
            )
        if self.hand is not None and not self.hand.hand:
            raise InputError(
                f"{HAND}.{HAND}: missing; choose from {', '.join(HANDS)}, or name an MJCF or URDF "
                "file"
            )
        if self.published and not _is_date(self.published):
            raise InputError(
                f"published: expected a day such as 2026-11-22, got {shown(self.published)}"
            )

    @property
    def asked(self) -> Learning:
        """What the tables hold besides for learners, with nothing for None."""
        return self.learning or Learning()

    def groups(self, joints: int) -> dict[str, int]:
        """Return the groups of columns that the tables have on request, with their sizes.

        The size of those about the hand is its number of joints.
        """
        executed = self.execution is not None
        asked = {} if self.learning is None else self.learning.groups(executed=executed)
        own = {HAND: joints} if self.hand is not None else {}
        return {**({EXECUTED: 1} if executed else {}), **asked, **own}

    @property
    def sha256(self) -> str:
        """SHA-256 of the text with all settings."""
        import hashlib  # slow, and no flag needs it

        return hashlib.sha256(settings_text(self).encode()).hexdigest()


def config_from_toml(path: Path) -> DatasetConfig:
    """Read a configuration from a file."""
    from sim_validate.files.toml_files import read_tables  # slow, and no flag needs it

    given = read_tables(path)
    with about(path):
        return DatasetConfig.of_table(given)


def _is_date(text: str) -> bool:
    try:
        return date.fromisoformat(text).isoformat() == text
    except ValueError:
        return False


def config_to_toml(config: DatasetConfig) -> str:
    """Write a configuration as a file, whose first line tells editors where its schema is."""
    from sim_validate.schemas.file_schemas import address  # slow, and no flag needs it

    return f"#:schema {address('dataset')}\n{settings_text(config)}"


def settings_text(config: DatasetConfig) -> str:
    """Write every setting in the order of the class; equal configurations give equal texts."""
    given = as_table(config)
    tables = {name: given.pop(name) for name in (EXECUTING, LEARNING, HAND) if name in given}
    parts = [_lines(given), *(f"[{name}]\n{_lines(each)}" for name, each in tables.items())]
    return "\n".join(parts)


def _lines(values: Mapping[str, object]) -> str:
    return "".join(f"{name} = {_as_toml(value)}\n" for name, value in values.items())


def _as_toml(value: object) -> str:
    if isinstance(value, tuple):
        return f"[{', '.join(map(_as_toml, cast('tuple[object, ...]', value)))}]"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return quoted(value)
    return repr(value)
