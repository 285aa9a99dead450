"""Reads and checks the configuration of a dataset, from a TOML file or flags; writes it as TOML.

Everything that decides a row is here. So the hash of the resolved text, together with the hashes of
the meshes and the versions, identifies what a dataset can hold.
"""

import hashlib
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, fields
from datetime import date
from pathlib import Path
from typing import Any, Literal, TypeAlias, cast, get_args

from grasp_core.checked import LARGEST_FRICTION, MOST_RANDOM_WRENCHES, one_of, positive, whole
from grasp_core.errors import InputError, about
from grasp_core.files.json_text import place, settings_of, shown
from grasp_core.hands.named_hands import hand_names, load_hand
from grasp_core.objects.polyhedron import UNITS_M
from grasp_core.objects.surface import FaceKind
from grasp_core.planning.request import METHODS, ConeKind
from grasp_core.values import Method
from sim_validate.datasets.tables import Tables, dataset_tables
from sim_validate.execution.settings import (
    TABLE,
    AskedExecution,
    asked_execution,
    execution_table,
)
from sim_validate.files.toml_tables import read_tables

LEARNING = "learning"
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
LimitsKind: TypeAlias = Literal["none", "ramp", "bisection"]
KINDS: dict[str, tuple[str, ...]] = {
    "unit": tuple(UNITS_M),
    "faces": get_args(FaceKind),
    "cones": get_args(ConeKind),
    "limits": get_args(LimitsKind),
}
"""Settings whose value is one of a few words, with these words."""
LEAST = {"limit": 1, "random_wrenches": 0, "seed": 0}
"""Settings that are whole numbers, with their least values."""
MOST = {"limit": 10**9, "random_wrenches": MOST_RANDOM_WRENCHES, "seed": 2**63 - 1}
"""Settings that are whole numbers, with their largest values."""
SWITCHES = ("scenes", "outward")
"""Settings that are true or false."""
CREDITS = ("title", "license", "creator", "url", "published")
"""Settings that only inform people; no row depends on them."""
LISTS: dict[str, type[str] | type[float]] = {"objects": str, "frictions": float, "families": str}
"""Settings that are lists, with the type of their items."""
WORDS: dict[type, str] = {
    str: "text", float: "numbers", int: "a whole number", bool: "true or false",
}  # fmt: skip


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
        raise InputError(f"{LEARNING}: expected a table of settings, got {shown(table)}")
    given = cast("Mapping[str, Any]", table)
    known = [each.name for each in fields(Learning)]
    if unknown := [name for name in given if name not in known]:
        raise InputError(
            f"{LEARNING}: no setting is named {shown(unknown[0])}; choose from {', '.join(known)}"
        )
    return settings_of(Learning, given, [LEARNING])


def learning_table(asked: Learning) -> dict[str, Any]:
    """Return every setting as the table that gives the same settings when it is read."""
    return {each.name: getattr(asked, each.name) for each in fields(asked)}


@dataclass(frozen=True, slots=True)
class DatasetConfig:
    """Settings of a dataset: objects, frictions, families, and how grasps are planned and tried.

    Raises:
        InputError: A setting is out of range.
    """

    objects: tuple[str, ...]
    """Mesh files, or names of built-in objects."""
    frictions: tuple[float, ...] = (0.5,)
    """Coulomb coefficients; grasps of each object are planned and simulated at each of them."""
    families: tuple[Method, ...] = METHODS
    limit: int = 20
    """Largest number of grasps for each object, friction and family."""
    cones: ConeKind = "tilted"
    unit: str = "m"
    """Unit of length in mesh files, such as `mm`."""
    scale: float = 1.0
    """Factor on the coordinates of mesh files, besides their unit."""
    faces: FaceKind = "auto"
    limits: LimitsKind = "none"
    """How the largest multiples of wrenches are found in simulation."""
    random_wrenches: int = 0
    """Number of random wrenches to hold besides the usual ones."""
    seed: int = 0
    """Seed of all random choices."""
    contacts: str = ""
    """Path of a file of contacts on the one object, which are judged instead of planned ones; empty
    to plan."""
    outward: bool = False
    """Whether normals in that file point out of the object."""
    scenes: bool = False
    """Whether each grasp is also written as a MuJoCo scene."""
    title: str = "four-finger grasps"
    """Title of the dataset. The title and the settings below only appear in the dataset's
    README.md; no row depends on them."""
    license: str = ""
    """Licence of the dataset, such as `CC-BY-4.0`."""
    creator: str = ""
    """Who made the dataset."""
    url: str = ""
    """Web address at which the dataset will be found."""
    published: str = ""
    """Date of publication, such as `2026-11-22`. It is a setting, because a clock would make every
    build differ."""
    execution: AskedExecution | None = None
    """How grasps are executed besides: with true mass and springy fingers; None to leave it out."""
    learning: Learning | None = None
    """What the tables hold besides for learners; None for nothing."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "frictions", tuple(map(float, self.frictions)))
        object.__setattr__(self, "scale", positive(self.scale, "scale"))
        for name in ("objects", "frictions", "families"):
            values: tuple[object, ...] = getattr(self, name)
            twice = [value for value, count in Counter(values).items() if count > 1]
            if not values or twice:
                got = f"{shown(twice[0])} twice" if twice else "none"
                raise InputError(
                    f"{name}: expected a list of one or more different items, got {got}"
                )
        wrong = [friction for friction in self.frictions if not 0.0 < friction <= LARGEST_FRICTION]
        if wrong:
            most = f"{LARGEST_FRICTION:g}"
            raise InputError(
                f"frictions: expected numbers above 0 and at most {most}, got {wrong[0]}"
            )
        if unknown := [family for family in self.families if family not in METHODS]:
            raise InputError(
                f"families: expected some of {', '.join(METHODS)}, got {shown(unknown[0])}"
            )
        if self.contacts and len(self.objects) > 1:
            raise InputError(
                "objects: expected only one object beside `contacts`, the one that the contacts "
                "are on"
            )
        if self.learning is not None and self.learning.executes and self.execution is None:
            raise InputError(
                f"{LEARNING}.{self.learning.executes}: only executed grasps have a mass and a "
                f"squeeze; add a table [{TABLE}], or leave this setting out"
            )
        self._check_words_and_counts()

    def _check_words_and_counts(self) -> None:
        for name, kinds in KINDS.items():
            if getattr(self, name) not in kinds:
                raise InputError(
                    f"{name}: expected one of {', '.join(kinds)}, got {shown(getattr(self, name))}"
                )
        for name, least in LEAST.items():
            if not least <= getattr(self, name) <= MOST[name]:
                span, got = f"{least} or more, up to {MOST[name]}", getattr(self, name)
                raise InputError(f"{name}: expected {span}, got {got}")
        if self.published and not _is_date(self.published):
            raise InputError(
                f"published: expected a day such as 2026-11-22, got {shown(self.published)}"
            )

    @property
    def tables(self) -> Tables:
        """Tables of the dataset, with their columns."""
        return dataset_tables(executed=self.execution is not None, groups=self.groups)

    @property
    def groups(self) -> dict[str, int]:
        """Groups of columns that the tables have on request, with their sizes."""
        if self.learning is None:
            return {}
        return self.learning.groups(executed=self.execution is not None)

    @property
    def sha256(self) -> str:
        """SHA-256 of the text with all settings."""
        return hashlib.sha256(config_to_toml(self).encode()).hexdigest()


def config_from_toml(path: Path) -> DatasetConfig:
    """Read a configuration from a file."""
    given = read_tables(path)
    with about(path):
        return config_from_settings(given)


def config_from_settings(given: Mapping[str, Any]) -> DatasetConfig:
    """Build a configuration from named settings with the types that TOML has."""
    known = [each.name for each in fields(DatasetConfig)]
    if unknown := [name for name in given if name not in known]:
        raise InputError(f"{place(unknown[:1])}: no such setting; choose from {', '.join(known)}")
    if "objects" not in given:
        raise InputError(
            "objects: expected a list of mesh files or built-in objects, but the setting is missing"
        )
    return DatasetConfig(**{name: _typed(name, value) for name, value in given.items()})


def _typed(name: str, value: Any) -> Any:
    """Check a setting, and convert it to the type it has in the configuration."""
    if name == TABLE:
        return asked_execution(value)
    if name == LEARNING:
        return asked_learning(value)
    kinds = {**LISTS, **dict.fromkeys(LEAST, int), **dict.fromkeys(SWITCHES, bool)}
    if name == "scale":  # checked by the class
        return value
    wanted = kinds.get(name, str)
    if name not in LISTS:
        if not _is(value, wanted):
            raise InputError(f"{name}: expected {WORDS[wanted]}, got {shown(value)}")
        return value
    if not isinstance(value, list):
        raise InputError(f"{name}: expected a list of {WORDS[wanted]}, got {shown(value)}")
    listed = cast("list[object]", value)
    odd = [one for one in listed if not _is(one, wanted)]
    if odd:
        raise InputError(f"{name}: expected a list of {WORDS[wanted]}, got {shown(odd[0])} in it")
    return tuple(float(cast("float", one)) if wanted is float else one for one in listed)


def _is(value: object, wanted: type) -> bool:
    if isinstance(value, bool):
        return wanted is bool
    return isinstance(value, (int, float) if wanted is float else wanted)


def _is_date(text: str) -> bool:
    """Tell whether a text is a day as YYYY-MM-DD, the form that all readers know."""
    try:
        return date.fromisoformat(text).isoformat() == text
    except ValueError:
        return False


def config_to_toml(config: DatasetConfig) -> str:
    """Write every setting in the order of the class; equal configurations give equal texts."""
    tables = (TABLE, LEARNING)
    own = {
        each.name: getattr(config, each.name) for each in fields(config) if each.name not in tables
    }
    parts = [_lines(own)]
    if config.execution is not None:
        table = execution_table(config.execution)
        hand = table.pop("hand")
        parts += [f"[{TABLE}]\n{_lines(table)}", f"[{TABLE}.hand]\n{_lines(hand)}"]
    if config.learning is not None:
        parts += [f"[{LEARNING}]\n{_lines(learning_table(config.learning))}"]
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


def quoted(text: str) -> str:
    """Write a text as a basic string of TOML, printable and on one line; YAML reads it alike."""
    return '"' + "".join(map(_escaped, text)) + '"'


def _escaped(letter: str) -> str:
    """Write a character inside a quoted string, escaped if necessary."""
    if letter in '"\\':
        return "\\" + letter
    return letter if letter.isprintable() else f"\\U{ord(letter):08x}"
