"""Writes the rows of all units of work into the tables of a dataset, one object at a time.

Rows are sorted by object, then by their table's key, so the files do not depend on when, where or
in which run each unit was computed. Only the rows of one object, and rows that wait to be written,
are in memory.
"""

import shutil
from collections.abc import Sequence
from dataclasses import replace
from itertools import groupby
from pathlib import Path

from grasp_core.files.text_files import write_text
from grasp_core.provenance import arithmetic
from sim_validate.datasets.building.staging import Finished, Staging
from sim_validate.datasets.config import DatasetConfig, config_to_toml
from sim_validate.datasets.describing.card import CARD, card_text
from sim_validate.datasets.given_contacts import given_text
from sim_validate.datasets.manifest import SCHEMA, Listed, Manifest, listed, write_manifest
from sim_validate.datasets.quarantine import LeftOut, left_out_text
from sim_validate.datasets.table_files import TableFiles
from sim_validate.datasets.units import WorkUnit, provenance, units_sha256

DATA = "data"
TWIN = "the same object as"
"""First words of the reason why an object with the same mesh as another has no rows."""
CONTACTS = "contacts.json"
"""Name of the file with the given contacts, if there are any; its normals point into the object."""
CONFIG, QUARANTINE = "config.toml", "quarantine.jsonl"
EXTRAS = ("meshes", "scenes")
"""Folders of the files that units make besides their rows."""


def finish(
    config: DatasetConfig, units: Sequence[WorkUnit], staging: Staging, folder: Path
) -> None:
    """Write the rows of all units into tables, list all files, and remove the staging folder."""
    for name in (DATA, *EXTRAS):
        shutil.rmtree(folder / name, ignore_errors=True)
    good, quarantined = _sorted_out(units, staging)
    tables = _write_tables(config, good, staging, folder)
    for each in good:
        staging.copy_files(each.unit, folder)
    given = {each.id: each for unit in units for each in unit.given}
    if given:
        in_order = [given[name] for name in sorted(given)]
        write_text(folder / CONTACTS, given_text(in_order))
    others = [
        write_text(folder / CONFIG, config_to_toml(config)),
        write_text(folder / QUARANTINE, left_out_text(quarantined)),
        *([folder / CONTACTS] if given else []),
        *(path for name in EXTRAS for path in sorted((folder / name).glob("*"))),
    ]
    manifest = Manifest(
        config_sha256=config.sha256,
        versions=dict(provenance()),
        arithmetic=arithmetic(),
        units=len(units),
        units_sha256=units_sha256(units),
        quarantined=len(quarantined),
        executed=config.execution is not None,
        groups=config.groups,
        files=(*tables, *(listed(folder, path) for path in others)),
    )
    card = write_text(folder / CARD, card_text(config, manifest))
    write_manifest(folder, replace(manifest, files=(*manifest.files, listed(folder, card))))
    staging.remove()


def _sorted_out(
    units: Sequence[WorkUnit], staging: Staging
) -> tuple[list[Finished], list[LeftOut]]:
    """List units with rows of their own, sorted by object, and the reasons why others have none."""
    good, quarantined = list[Finished](), list[LeftOut]()
    first: dict[tuple[str, float], str] = {}
    for unit in sorted(units, key=lambda each: (each.object, each.friction)):
        found = staging.result(unit)
        if isinstance(found, Finished):
            other = first.setdefault((found.object_id, unit.friction), unit.object)
            if other == unit.object:
                good.append(found)
                continue
            found = f"{TWIN} {other}"
        quarantined.append(
            LeftOut(
                object=unit.object,
                source_sha256=unit.source_sha256,
                friction=unit.friction,
                given=[each.id for each in unit.given],
                reason=found,
            )
        )
    return sorted(good, key=lambda each: (each.object_id, each.unit.friction)), quarantined


def _write_tables(
    config: DatasetConfig, good: Sequence[Finished], staging: Staging, folder: Path
) -> list[Listed]:
    about = {"schema": str(SCHEMA), "config_sha256": config.sha256}
    with TableFiles(folder / DATA, about, config.tables) as files:
        for _, same in groupby(good, key=lambda each: each.object_id):
            of_object = list(same)
            for name in config.tables:
                chosen = of_object[:1] if name == "objects" else of_object
                paths = [staging.table(each.unit, name) for each in chosen]
                files.add(name, of_object[0].split, paths)
        return [
            replace(listed(folder, each.path), table=each.name, split=each.split, rows=each.rows)
            for each in files.close()
        ]
