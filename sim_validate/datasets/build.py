"""Builds a dataset in a folder; work finished by an earlier, interrupted build is not repeated.

Rows are sorted by object, then by their table's key, so the files do not depend on when, where or
in which run each unit was computed. Only the rows of one object, and rows that wait to be written,
are in memory. The manifest, which lists all files, is written last; then the staging folder is
removed.

The README.md describes the dataset to people and to the Hugging Face Hub, a website for datasets
that calls this page a card; `card.md.jinja` holds its sentences. A user's own words are escaped: in
the header as quoted strings, in the text as Markdown.
"""

import inspect
import re
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import groupby, product
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

from grasp_core.errors import InputError
from grasp_core.files.text_files import read_text, write_text
from grasp_core.provenance import arithmetic
from scenes.drawing.pages import filled
from sim_validate.datasets.columns import joined, pyarrow, write_files
from sim_validate.datasets.config import (
    KEYS,
    REFERENCES,
    SPLITS,
    DatasetConfig,
    config_to_toml,
    quoted,
)
from sim_validate.datasets.open_dataset import (
    CONFIG,
    MANIFEST,
    QUARANTINE,
    LeftOut,
    Listed,
    Manifest,
    left_out_text,
    listed,
    read_manifest,
    write_manifest,
)
from sim_validate.datasets.rows import ROWS, dataset_tables
from sim_validate.datasets.units import WorkUnit, given_text, provenance, units_of, units_sha256
from sim_validate.datasets.workers import Engine, Staging, UnitRecord, drive
from sim_validate.engine.gate import require_faithful
from sim_validate.engine.setup import Setup
from sim_validate.kit.files import alone_in, path_inside

CARD = "README.md"
SIZES = ("1K", "10K", "100K", "1M", "10M", "100M", "1B", "10B", "100B")
"""Powers of ten, from a thousand, as the Hugging Face Hub names sizes of datasets."""
MARKS = frozenset("\\`*_[]<>|~&#!$@")
"""Characters that can begin Markdown or HTML within a line."""
SPDX = re.compile(r"[A-Za-z0-9.+-]+")
"""Pattern of a licence's name in SPDX; in small letters it is that of the Hugging Face Hub, but for
a few such as ODbL-1.0, there `odbl`."""
ADDRESS = re.compile(r"https?://[^\s<>\"'`\\|{}^]+")
"""Pattern of a web address that can stand in Markdown as a link unchanged."""
DATA = "data"
TWIN = "the same object as"
"""First words of the reason why an object with the same mesh as another has no rows."""
CONTACTS = "contacts.json"
"""Name of the file with the given contacts, if there are any; its normals point into the object."""
EXTRAS = ("meshes", "scenes")
"""Folders of the files that units make besides their rows."""
OWN = ("staging", DATA, *EXTRAS, CONTACTS, CONFIG, QUARANTINE, CARD, MANIFEST)
"""Names of all files and folders that the folder of a dataset may hold."""


Finished: TypeAlias = tuple[WorkUnit, UnitRecord]
"""A unit of work that has rows, with its record."""


class Built(NamedTuple):
    """The result of a build."""

    manifest: Manifest
    made: int
    """Number of units of work that were computed in this run."""


def build(
    config: DatasetConfig,
    folder: Path,
    engine: Engine,
    report: Callable[[int, int], None],
    timeout_s: float | None = None,
) -> Built:
    """Build a dataset, or resume an interrupted build; `report` takes (finished, total)."""
    pyarrow()  # before any work, so that a missing library is named at once
    units = units_of(config)
    _refuse_sources_inside(units, config, folder)
    with alone_in(folder):
        _refuse_others(folder, config)
        staging = Staging(folder.resolve() / "staging")
        if (folder / MANIFEST).is_file():
            staging.remove()
            return _as_built(folder, units)
        write_text(folder / CONFIG, config_to_toml(config))
        staging.folder.mkdir(exist_ok=True)
        left = [unit for unit in units if not staging.done(unit)]
        for unit in left:
            staging.forget(unit)
        for friction in config.frictions if left else ():
            # a gate that fails at one object's size only leaves that object out
            require_faithful(Setup(), friction)
        drive(left, staging, engine, report, timeout_s)
        _finish(config, units, staging, folder)
        return _as_built(folder, units, len(left))


def _refuse_sources_inside(units: Sequence[WorkUnit], config: DatasetConfig, folder: Path) -> None:
    sources = [unit.path for unit in units if unit.path is not None]
    sources += [Path(config.contacts).resolve()] if config.contacts else []
    for path in sources:
        if path.is_relative_to(folder.resolve()):
            raise InputError(
                f"{path}: this input lies in the output folder {folder}; give another --out"
            )


def _refuse_others(folder: Path, config: DatasetConfig) -> None:
    """Refuse a folder with other files, and remove half-written files of a killed build."""
    stated = folder / CONFIG
    own = OWN if stated.is_file() else ()
    half_written = tuple(f".{name}." for name in OWN)
    for path in sorted(folder.iterdir()):
        if path.name.startswith(half_written):
            path.unlink()
        elif path.name not in own:
            raise InputError(
                f"{path}: this file is not part of the dataset to write; give an empty or new "
                "folder as --out"
            )
    if stated.is_file() and read_text(stated) != config_to_toml(config):
        raise InputError(
            f"{folder}: the folder holds a dataset made with other settings (see its {CONFIG}); "
            "give another --out, or the same settings to resume that dataset"
        )


def _as_built(folder: Path, units: Sequence[WorkUnit], made: int = 0) -> Built:
    """Describe a finished dataset, after a check that it is the one asked for."""
    manifest = read_manifest(folder)
    if manifest.units_sha256 != units_sha256(units):
        raise InputError(
            f"{folder}: this dataset is finished, but its meshes, contacts or package versions "
            "have changed since then; give another --out to make it again"
        )
    for each in manifest.files:
        path = path_inside(folder, each.path)
        if not path.is_file() or path.stat().st_size != each.bytes:
            raise InputError(
                f"{path}: this file of a finished dataset is missing or damaged (see `dataset "
                "verify`); give another --out to make it again"
            )
    return Built(manifest, made)


def _finish(
    config: DatasetConfig, units: Sequence[WorkUnit], staging: Staging, folder: Path
) -> None:
    """Write the rows of all units into tables, list all files, and remove the staging folder."""
    for name in (DATA, *EXTRAS):
        shutil.rmtree(folder / name, ignore_errors=True)
    good, quarantined = _sorted_out(units, staging)
    tables = _write_tables(config, good, staging, folder)
    for unit, _ in good:
        staging.copy_files(unit, folder)
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
    first: dict[tuple[str | None, float], str] = {}
    for unit in sorted(units, key=lambda each: (each.object, each.friction)):
        record = staging.record(unit)
        reason = record.reason
        if reason is None:
            other = first.setdefault((record.object_id, unit.friction), unit.object)
            if other == unit.object:
                good.append((unit, record))
                continue
            reason = f"{TWIN} {other}"
        given = tuple(each.id for each in unit.given)
        quarantined.append(LeftOut(unit.object, unit.source_sha256, unit.friction, given, reason))
    return sorted(good, key=lambda each: (str(each[1].object_id), each[0].friction)), quarantined


def _write_tables(
    config: DatasetConfig, good: Sequence[Finished], staging: Staging, folder: Path
) -> list[Listed]:
    tables, found = dataset_tables(config.groups), list[Listed]()
    about = {"schema": str(Manifest.SCHEMA), "config_sha256": config.sha256}
    objects = groupby(good, key=lambda each: (each[1].object_id, each[1].split))
    units = [(split, [unit for unit, _ in same]) for (_, split), same in objects]
    for name, (split, _) in product(tables, SPLITS):
        parts = (
            joined([staging.table(unit, name) for unit in chosen], name, tables)
            for own, of_object in units if own == split
            for chosen in [of_object[:1] if name == "objects" else of_object]
        )  # fmt: skip
        found += [
            replace(listed(folder, path), table=name, split=split, rows=rows)
            for path, rows in write_files(folder / DATA / name, split, parts, about)
        ]
    return found


def card_text(config: DatasetConfig, manifest: Manifest) -> str:
    """Write the README.md of a dataset."""
    rows, tables = manifest.rows, list(_tables(manifest))
    (of_grasps,) = (table["splits"] for table in tables if table["name"] == "grasps")
    chances = [
        f"{name} {upto - before:.0%}"
        for (name, upto), before in zip(SPLITS, (0.0, *(upto for _, upto in SPLITS)), strict=False)
    ]
    return filled(
        "card.md.jinja",
        Path(__file__).parent,
        config=config,
        settings=config_to_toml(config),
        manifest=manifest,
        rows=rows,
        tables=tables,
        executed=config.execution,
        hub_license=config.license.lower() if SPDX.fullmatch(config.license) else "",
        credits={
            "Creator": _as_markdown(config.creator),
            "Address": _as_address(config.url),
            "Published": _as_markdown(config.published),
            "Licence": _as_address(config.license),
        },
        size=_size(sum(rows.values())),
        chances=", ".join(reversed(chances)),
        split=next(iter(of_grasps), "train"),
        quoted=quoted,
        markdown=_as_markdown,
        references=REFERENCES,
    )


def _size(rows: int) -> str:
    """Return the name that the Hugging Face Hub has for datasets of about as many rows."""
    place = min(max(len(str(rows)) - 3, 0), len(SIZES) - 1)
    return f"{SIZES[place - 1]}<n<{SIZES[place]}" if place else f"n<{SIZES[0]}"


def _tables(manifest: Manifest) -> Iterator[Mapping[str, Any]]:
    for name, columns in manifest.tables.items():
        splits = {
            split: manifest.count(name, split)
            for split, _ in reversed(SPLITS)
            if manifest.of_table(name, split)
        }
        yield {
            "name": name,
            "row": inspect.getdoc(ROWS[name]),
            "splits": splits,
            "sorted_by": " and ".join(f"`{key}`" for key in KEYS[name]),
            "columns": columns,
        }


def _as_address(text: str) -> str:
    """Write a web address as a link, and any other text of a user as Markdown."""
    if text.isprintable() and ADDRESS.fullmatch(text) is not None:
        return f"<{text}>"
    return _as_markdown(text)


def _as_markdown(text: str) -> str:
    """Write a user's text on one line, with all Markdown and HTML escaped."""
    line = "".join(letter if letter.isprintable() else " " for letter in text).strip()
    return "".join(f"\\{letter}" if letter in MARKS else letter for letter in line)
