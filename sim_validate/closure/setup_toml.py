"""Reads and writes simulation settings as TOML.

The tables are `physics`, `fingers`, `hold`, `limit` and `friction`; all are optional.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

from grasp_core.errors import InputError, about
from grasp_core.settings import Settings, for_users, named
from scenes.settings import PhysicsSettings
from sim_validate.engine.setup import Setup
from sim_validate.kit.toml_tables import read_tables


def setup_from_file(path: Path, setup: Setup) -> Setup:
    """Read settings from a file and put them in place of those in `setup`."""
    return setup_from_tables(read_tables(path), setup, str(path))


def setup_from_tables(tables: Mapping[str, Any], setup: Setup, path: str) -> Setup:
    """Put the settings in TOML tables in place of those in `setup`."""
    with about(path):
        return Setup.of_table(tables, usual=setup)


def physics_from_file(path: Path) -> dict[str, Any]:
    """Read the settings in the table `physics` of a file, by name."""
    with about(path):
        given = named(read_tables(path), ("physics",), "").get("physics", {})
        if "gravity" in given:
            raise InputError(
                "physics.gravity is that of the earth; leave it out, and give its direction with "
                "--down"
            )
        checked = PhysicsSettings.of_table(given, "physics")
    return {name: getattr(checked, name) for name in given}


def tables_of(setup: Setup) -> dict[str, dict[str, Any]]:
    """Write a setup as the TOML tables that would reproduce it."""
    return {
        table: {name: getattr(part, name) for name in for_users(type(part))}
        for table in for_users(Setup)
        for part in [cast("Settings", getattr(setup, table))]
    }
