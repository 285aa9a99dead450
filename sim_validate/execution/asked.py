"""Reads the settings of executions from a table of a settings file, and writes them as one.

Objects of one file may differ in size, so a density can stand in place of the mass: each object
then has the mass that follows from its volume.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from typing import Any, cast

from grasp_core.checked import positive
from grasp_core.errors import InputError
from grasp_core.files.json_text import settings_of, shown
from grasp_core.objects.polyhedron import Polyhedron
from scenes.execution.held import HeldSettings
from sim_validate.execution.settings import ExecutionSettings

TABLE = "execution"
"""Name of the table in a settings file."""
MASS, DENSITY = "mass_kg", "density_kg_m3"
KNOWN = (*(each.name for each in fields(ExecutionSettings)), DENSITY)
KNOWN_OF_HAND = tuple(each.name for each in fields(HeldSettings))
ANY_MASS_KG = 1.0
"""Mass that stands in the settings until a density gives each object its own."""


@dataclass(frozen=True, slots=True)
class AskedExecution:
    """How the grasps of all objects of a file are executed.

    Raises:
        InputError: The density is out of range.
    """

    settings: ExecutionSettings
    """Settings of every execution; their mass does not count where a density is given."""
    density_kg_m3: float | None = None
    """Density of every object; None where all objects have the mass of the settings [kg/m^3]."""

    def __post_init__(self) -> None:
        if self.density_kg_m3 is not None:
            positive(self.density_kg_m3, DENSITY)

    def settings_for(self, body: Polyhedron) -> ExecutionSettings:
        """Return the settings with the mass of an object."""
        if self.density_kg_m3 is None:
            return self.settings
        return replace(self.settings, mass_kg=body.mass_at(self.density_kg_m3))


def asked_execution(table: object) -> AskedExecution:
    """Read the table `[execution]` of a settings file."""
    if not isinstance(table, Mapping):
        raise InputError(f"{TABLE}: expected a table of settings, got {shown(table)}")
    given = {**cast("Mapping[str, Any]", table)}
    _check_names(given, KNOWN, TABLE)
    if isinstance(hand := given.get("hand"), dict):
        _check_names(cast("dict[str, Any]", hand), KNOWN_OF_HAND, f"{TABLE}.hand")
    if (MASS in given) == (DENSITY in given):
        got = "both" if MASS in given else "neither"
        raise InputError(f"{TABLE}: expected one of {MASS} and {DENSITY}, got {got}")
    density = given.pop(DENSITY, None)
    if density is not None and (isinstance(density, bool) or not isinstance(density, int | float)):
        raise InputError(f"{TABLE}.{DENSITY}: expected a number, got {shown(density)}")
    settings = settings_of(ExecutionSettings, {MASS: ANY_MASS_KG, **given}, [TABLE])
    try:
        return AskedExecution(settings, None if density is None else float(density))
    except InputError as error:
        raise InputError(f"{TABLE}: {error}") from error


def _check_names(given: Mapping[str, Any], known: tuple[str, ...], where: str) -> None:
    for name in given:
        if name not in known:
            raise InputError(
                f"{where}: no setting is named {shown(name)}; choose from {', '.join(known)}"
            )


def execution_table(asked: AskedExecution) -> dict[str, Any]:
    """Return every setting as the table that gives the same settings when it is read."""
    given = asdict(asked.settings).items()
    table = {name: value for name, value in given if value is not None}  # TOML has no null
    if asked.density_kg_m3 is None:
        return table
    del table[MASS]
    return {DENSITY: asked.density_kg_m3, **table}
