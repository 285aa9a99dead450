"""Reads and writes simulation settings as TOML.

The tables are `physics`, `fingers`, `hold`, `limit` and `friction`; all are optional.
"""

from collections.abc import Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, cast

from grasp_core.errors import InputError, about
from grasp_core.files.json_text import named_settings, settings_of, shown
from scenes.fingertips import FingerSettings
from scenes.physics import PhysicsSettings
from sim_validate.files.toml_tables import read_tables
from sim_validate.simulation.schedules import FrictionProtocol, HoldProtocol, LimitProtocol
from sim_validate.simulation.setup import Setup

OURS = ("drive", "indentation")
"""Finger settings that each trial chooses itself, so that a file may not set them."""
OF_USERS = {
    table: tuple(field.name for field in fields(kind) if field.name not in OURS)
    for table, kind in (
        ("physics", PhysicsSettings),
        ("fingers", FingerSettings),
        ("hold", HoldProtocol),
        ("limit", LimitProtocol),
        ("friction", FrictionProtocol),
    )
}
"""The settings that a file may change, by table."""


def setup_from_file(path: Path, setup: Setup) -> Setup:
    """Read settings from a file and put them in place of those in `setup`."""
    return setup_from_tables(read_tables(path), setup, str(path))


def setup_from_tables(tables: Mapping[str, Any], setup: Setup, path: str) -> Setup:
    """Put the settings in TOML tables in place of those in `setup`."""
    for name, given in tables.items():
        if name not in OF_USERS or not isinstance(given, dict):
            raise InputError(f"{path}: expected tables {', '.join(OF_USERS)}, got {shown(name)}")
        table = cast("dict[str, Any]", given)
        filled = _filled(path, name, getattr(setup, name), table)
        with about(f"{path}: {name}"):  # a part may be valid, but not fit the predictions
            setup = replace(setup, **{name: filled})
    return setup


def physics_from_file(path: Path) -> dict[str, Any]:
    """Read the settings in the table `physics` of a file, by name."""
    given: dict[str, Any] = {}
    for name, table in read_tables(path).items():
        if name != "physics" or not isinstance(table, dict):
            raise InputError(f"{path}: expected the table physics, got {shown(name)}")
        given = cast("dict[str, Any]", table)
    if "gravity" in given:
        raise InputError(
            f"{path}: physics.gravity is that of the earth; leave it out, and give its "
            "direction with --down"
        )
    checked = _filled(str(path), "physics", PhysicsSettings(), given)
    return {name: getattr(checked, name) for name in given}


def tables_of(setup: Setup) -> dict[str, dict[str, Any]]:
    """Write a setup as the TOML tables that would reproduce it."""
    tables = {
        table: {name: getattr(getattr(setup, table), name) for name in names}
        for table, names in OF_USERS.items()
    }
    return tables | {"physics": setup.physics.record()}


def _filled(path: str, table: str, values: Any, given: dict[str, Any]) -> Any:
    """Replace some fields of a group of settings, each checked against its type."""
    with about(path):
        own = named_settings(given, OF_USERS[table], table)
        usual = {each.name: getattr(values, each.name) for each in fields(values)}
        return settings_of(cast("type[Any]", type(values)), usual | own, [table])
