"""Shows figures of records: as cells of tables and pages, as columns, and with their meaning.

A figure is a field or a property whose kind carries `Shown` or `Compared`; its docstring is its
meaning, and the end of its name its unit. Whoever shows records, keeps their figures in files and
tables, or compares them with earlier ones, asks here which figures they have, so that a new figure
appears everywhere at once.
"""

import ast
import inspect
import math
import operator
import re
import textwrap
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import cache
from typing import Any, NamedTuple, cast

from grasp_core.declared import rules
from grasp_core.files.records import entries, returned

NONE = "-"
"""What a cell shows where there is no figure."""
UNITS = {
    "m": "m", "m3": "m3", "rad": "rad", "deg": "deg", "s": "s", "n": "N", "nm": "N m", "kg": "kg",
    "m_per_s": "m/s", "n_per_m": "N/m", "kg_m2": "kg m^2", "n_nm": "N, N m", "n_s": "N s",
    "n_m": "N m", "kg_m3": "kg/m^3", "n_s_per_m": "N s/m", "n_m_per_rad": "N m/rad", "mm": "mm",
    "m_per_s2": "m/s^2", "hz": "Hz",
}  # fmt: skip
"""Units by the ends of names; the longest end counts."""
IN_BRACKETS = re.compile(r" \[[^]]*\]")
"""Pattern of the unit in a meaning, such as ` [m]`."""

Worse = Callable[[Any, Any], bool]
"""A function that tells whether a change is for the worse, of the figure before and after."""
more, less, changed = operator.lt, operator.gt, operator.ne
"""Tell from a figure before and after whether it has grown, become smaller, or is another one."""


@dataclass(frozen=True, slots=True)
class Compared:
    """How a figure is compared with that of an earlier record, as baselines do.

    Numbers may differ within a band, motions in metres and radians by absolute ones; all else must
    be the same. A figure that says nothing of it is compared like a simulated number, and each
    change counts as worse: a new figure raises a question where it should not, but hides nothing.
    """

    worse: Worse | None = changed
    """Whether a change is for the worse; None for a figure that is kept without being compared."""
    words: str = ""  # what messages call it, if not by its name
    items: tuple[str, str] | None = None
    """What messages say of items that came into a list of faults, and of those that left it; None
    for a list of which only the number of items is kept."""
    analysed: bool = False
    """Whether the number comes from the analysis, which depends less on rounding."""
    friction: bool = False
    """Whether it is a friction, which other shapes of a part change by a share of the friction."""
    follows: bool = False  # whether it also changes where a wrench is now held, or no longer
    of_part: bool = False  # whether another shape of the part may change it
    close: str = ""
    """Name of the figure that says where rounding may decide: whether it does, or for which items
    of a list."""


BY_DEFAULT = Compared()


@dataclass(frozen=True, slots=True)
class Shown:
    """How tables and pages show a figure."""

    heading: str  # a few words above the column
    form: str = ".4g"  # format of a number
    times: float = 1.0  # factor on a number, such as 1e6 for micrometres
    infinite: str = "never"
    """What stands for an infinite number: most figures are multiples at which something happens."""
    compared: Compared | None = BY_DEFAULT
    """How it is compared with an earlier one; None if others say the same and are compared."""
    rounding: float = 0.0  # size up to which a number comes from rounding, and is shown as zero
    least: float = -math.inf
    """Number that stands for all smaller ones, too, and is shown as an infinite one is."""


class figure(property):  # noqa: N801 - it is used as a decorator, as `property` is
    """A property that is a figure although no file of the record holds it."""


class Figure(NamedTuple):
    """A figure of a class of records."""

    name: str
    kind: Any
    shown: Shown
    compared: Compared | None
    meaning: str
    path: tuple[str, ...]
    """Attributes that lead to it; more than one where it stands in a flat part of the record."""

    @property
    def called(self) -> str:
        """What messages call the figure."""
        return (self.compared and self.compared.words) or self.name

    @property
    def explained(self) -> str:
        """Its meaning beside its heading, which names the unit of a number that is shown scaled."""
        return self.meaning if self.shown.times == 1.0 else IN_BRACKETS.sub("", self.meaning)

    def of(self, record: Any) -> Any:
        """Return the figure of a record; None where the record lacks the part that has it."""
        for name in self.path:
            record = None if record is None else getattr(record, name)
        return record

    def lacking(self, record: object) -> bool:
        """Return whether a record lacks the part that has the figure."""
        return self._replace(path=self.path[:-1]).of(record) is None

    def cell(self, record: object) -> str:
        """Write the figure of a record for people."""
        return cell(self.of(record), self.shown)


@cache
def figures(kind: type) -> tuple[Figure, ...]:
    """Return the figures that tables and pages show of a class, in the order of its entries."""
    return tuple(_marked(kind, Shown))


@cache
def compared(kind: type) -> tuple[Figure, ...]:
    """Return the figures of a class that are kept, to be compared with those of later records."""
    return tuple(each for each in _marked(kind, Shown, Compared) if each.compared is not None)


def _marked(kind: type, *marks: type[Shown | Compared]) -> Iterator[Figure]:
    """Yield the figures whose kinds carry one of some marks, those of flat parts among them."""
    said = meanings(kind)
    listed = [(each.name, each.kind, each.flat) for each in entries(kind)]
    members = {name: each for base in reversed(kind.__mro__) for name, each in vars(base).items()}
    listed += [(name, returned(kind, name), None)
               for name, each in members.items() if isinstance(each, figure)]  # fmt: skip
    for name, own_kind, flat in listed:
        if flat is not None:
            for one in _marked(flat, *marks):
                yield one._replace(path=(name, *one.path))
        for rule in (rule for rule in rules(own_kind) if isinstance(rule, marks)):
            shown = rule if isinstance(rule, Shown) else Shown(rule.words or name)
            how = rule.compared if isinstance(rule, Shown) else rule
            yield Figure(name, own_kind, shown, how, said.get(name, ""), (name,))


def cell(value: Any, shown: Shown) -> str:
    """Write a figure for people: ends of a range that differ, and the number of other items."""
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return NONE
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, Enum):
        return str(value.value).replace("_", " ")
    if isinstance(value, int | float):
        return _number(value, shown)
    if isinstance(value, str):
        return value
    items: Sequence[Any] = value
    numbers = bool(items) and all(isinstance(item, float) for item in items)
    ends = dict.fromkeys(cell(item, shown) for item in items)
    return " to ".join(ends) if numbers else str(len(items))


def _number(value: float, shown: Shown) -> str:
    if math.isinf(value) or value <= shown.least:
        return shown.infinite
    size = 0.0 if abs(value) <= shown.rounding else shown.times * value
    return format(size, f"z{shown.form}")  # z: zero has no sign


def table(records: Iterable[object], kind: type) -> tuple[Sequence[str], list[tuple[str, ...]]]:
    """Return headings and rows of a table of records, without figures that none of them has."""
    records = list(records)
    listed = [each for each in figures(kind) if any(each.of(one) is not None for one in records)]
    rows = [tuple(each.cell(record) for each in listed) for record in records]
    return [each.shown.heading for each in listed], rows


def scalars(record: object) -> Mapping[str, Any]:
    """Return the plain entries of a record and its flat parts: numbers, words, numbers of items."""
    found: dict[str, Any] = {}
    for each in entries(type(record)):
        value = getattr(record, each.name)
        if each.flat is not None:
            found |= {} if value is None else scalars(value)
        elif isinstance(value, Enum):
            found[each.name] = value.value
        elif value is None or isinstance(value, str | bool | int | float):
            found[each.name] = value
        elif isinstance(value, tuple):
            items = cast("tuple[Any, ...]", value)
            if not any(isinstance(item, int | float) for item in items):
                found[each.name] = len(items)
    return found


@cache
def meanings(kind: type) -> Mapping[str, str]:
    """Return what the fields and recorded properties of a class mean: their docstrings."""
    found: dict[str, str] = {}
    kept: Mapping[str, Figure] = getattr(kind, "FIGURES", {})
    found |= {name: each.meaning for name, each in kept.items()}
    for base in (base for base in reversed(kind.__mro__) if base.__module__ != "builtins"):
        (body,) = ast.parse(textwrap.dedent(inspect.getsource(base))).body
        statements = body.body if isinstance(body, ast.ClassDef) else []
        for one, two in zip(statements, [*statements[1:], None], strict=True):
            if isinstance(one, ast.FunctionDef):
                found[one.name] = " ".join((ast.get_docstring(one) or "").split())
            elif isinstance(one, ast.AnnAssign) and isinstance(one.target, ast.Name):
                text = two.value if isinstance(two, ast.Expr) else None
                said = text.value if isinstance(text, ast.Constant) else ""
                found[one.target.id] = " ".join(str(said).split())
    return found


def unit_of(name: str) -> str:
    """Return the unit of a figure, by the end of its name; '' for a number without one."""
    parts = name.split("_")
    ends = ("_".join(parts[start:]) for start in range(1, len(parts)))
    return next((UNITS[end] for end in ends if end in UNITS), "")
