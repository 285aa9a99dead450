"""Merges finished datasets that were made with the same settings into one.

Datasets may differ in their objects, frictions and credits. Of an object that several have at one
friction, the rows of the first count. Memory holds one object of each dataset at a time.
"""

import shutil
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from hashlib import sha256
from itertools import groupby
from pathlib import Path

from grasp_core.errors import InputError
from grasp_core.files.text_files import write_text
from sim_validate.datasets.building.merged_parts import Part, Row, merged_config, part_of
from sim_validate.datasets.building.write_tables import CONFIG, DATA, EXTRAS, QUARANTINE
from sim_validate.datasets.columns import OF_OBJECTS, Name, Tables
from sim_validate.datasets.config import DatasetConfig, config_to_toml
from sim_validate.datasets.describing.card import CARD, card_text
from sim_validate.datasets.learning.splitting import assigned
from sim_validate.datasets.manifest import (
    SCHEMA,
    Listed,
    Manifest,
    listed,
    write_manifest,
)
from sim_validate.datasets.parquet import arrow_table
from sim_validate.datasets.quarantine import LeftOut, left_out_text, read_left_out
from sim_validate.datasets.rows import id_beginning
from sim_validate.datasets.table_files import TableFiles
from sim_validate.files.folder_lock import alone_in

MIXED = "several"
"""What a merged manifest says of versions that differ between the datasets."""
ABSENT = "no merged dataset has this object at this friction"
"""Reason for which an object has no rows at a friction that other objects have."""


def merge(folders: Sequence[Path], out: Path) -> Manifest:
    """Merge finished datasets into a new one.

    Args:
        folders: Folders of the datasets, at least two.
        out: Folder to write to, empty or new.

    Returns:
        The manifest of the merged dataset.

    Raises:
        InputError: A dataset is not finished or damaged, they differ in their settings, or the
            folder to write to holds files.
    """
    if len(folders) < 2:  # noqa: PLR2004 - of one there is nothing to merge
        raise InputError("datasets: expected at least two folders of datasets to merge")
    parts = [part_of(folder) for folder in folders]
    config = merged_config(parts)
    with alone_in(out):
        if there := sorted(out.iterdir()):
            raise InputError(f"{there[0]}: this folder is not empty; give an empty or new --out")
        return _written(parts, config, out)


def _written(parts: Sequence[Part], config: DatasetConfig, out: Path) -> Manifest:
    tables = _write_tables(parts, config, out)
    for part in parts:
        for name in EXTRAS:
            if (part.chosen.folder / name).is_dir():
                shutil.copytree(part.chosen.folder / name, out / name, dirs_exist_ok=True)
    left_out = _left_out(parts, config)
    others = [
        write_text(out / CONFIG, config_to_toml(config)),
        write_text(out / QUARANTINE, left_out_text(left_out)),
        *(path for name in EXTRAS for path in sorted((out / name).glob("*"))),
    ]
    manifests = [part.chosen.manifest for part in parts]
    names = {name for each in manifests for name in each.versions}
    every = "".join(sorted(each.units_sha256 for each in manifests))
    manifest = Manifest(
        config_sha256=config.sha256,
        versions={name: _same(each.versions.get(name, "") for each in manifests) for name in names},
        arithmetic=_same(each.arithmetic for each in manifests),
        units=sum(each.units for each in manifests),
        units_sha256=sha256(every.encode()).hexdigest(),
        quarantined=len(left_out),
        executed=config.execution is not None,
        groups=config.groups,
        files=(*tables, *(listed(out, path) for path in others)),
    )
    card = write_text(out / CARD, card_text(config, manifest))
    manifest = replace(manifest, files=(*manifest.files, listed(out, card)))
    write_manifest(out, manifest)
    return manifest


def _same(values: Iterable[str]) -> str:
    different = set(values)
    return different.pop() if len(different) == 1 else MIXED


def _left_out(parts: Sequence[Part], config: DatasetConfig) -> list[LeftOut]:
    """List what the datasets left out, and objects that none of them has at some friction."""
    every = _every(parts)
    found = [
        each for part in parts for each in read_left_out(part.chosen.folder / QUARANTINE)
        if not any(part.has(name, each.friction) for part in parts for name, row in every.items()
                   if row["source_sha256"] == each.source_sha256)
    ]  # fmt: skip
    known = {(each.source_sha256, each.friction) for each in found}
    for name, row in every.items():
        for friction in config.frictions:
            lacking = not any(part.has(name, friction) for part in parts)
            if lacking and (row["source_sha256"], friction) not in known:
                found.append(
                    LeftOut(
                        object=row["source_name"],
                        source_sha256=row["source_sha256"],
                        friction=friction,
                        given=[],
                        reason=ABSENT,
                    )
                )
    unique = {left_out_text([each]): each for each in found}
    return [unique[text] for text in sorted(unique)]


def _every(parts: Sequence[Part]) -> dict[str, Row]:
    """Return the row of each object, of the first dataset that has it."""
    return {name: row for part in reversed(parts) for name, row in part.objects.items()}


def _write_tables(parts: Sequence[Part], config: DatasetConfig, out: Path) -> list[Listed]:
    about = {"schema": str(SCHEMA), "config_sha256": config.sha256}
    splits = {name: row["split"] for name, row in _every(parts).items()}
    if config.learning is not None and config.counts_splits:
        classes = {name: row["shape_class"] for name, row in _every(parts).items()}
        splits = dict(assigned(classes, config.learning.split_by, config.seed))
    with TableFiles(out / DATA, about, config.tables) as files:
        for object_id, rows in _objects(parts, config):
            for name, own in rows.items():
                files.add_table(name, splits[object_id], arrow_table(name, own, {}, config.tables))
        return [
            replace(listed(out, each.path), table=each.name, split=each.split, rows=each.rows)
            for each in files.close()
        ]


def _objects(
    parts: Sequence[Part], config: DatasetConfig
) -> Iterator[tuple[str, Mapping[Name, list[Row]]]]:
    """Yield the merged rows of each object, sorted by object."""
    readers = [Reader(part, config.tables) for part in parts]
    for object_id in sorted(_every(parts)):
        having = [reader for reader in readers if object_id in reader.part.objects]
        rows = [reader.rows_of(object_id) for reader in having]
        merged: dict[Name, list[Row]] = {name: [] for name in config.tables}
        for name in OF_OBJECTS:
            if name in merged:
                merged[name] = rows[0][name]
        about_grasps: list[Name] = [name for name in config.tables if name not in OF_OBJECTS]
        for friction in config.frictions:
            beginning = id_beginning(object_id, friction)
            for reader, own in zip(having, rows, strict=True):
                if reader.part.has(object_id, friction):
                    for name in about_grasps:
                        merged[name] += [
                            row for row in own[name] if row["grasp_id"].startswith(beginning)
                        ]
                    break
        yield object_id, merged


class Reader:
    """Reads the rows of one dataset object by object, in the order of the objects' names."""

    def __init__(self, part: Part, tables: Tables) -> None:
        self.part = part
        self._streams: dict[Name, Iterator[tuple[str, list[Row]]]] = {
            name: self._groups(name) for name in tables
        }
        self._heads: dict[Name, tuple[str, list[Row]] | None] = {
            name: next(stream, None) for name, stream in self._streams.items()
        }

    def rows_of(self, object_id: str) -> dict[Name, list[Row]]:
        """Return the rows of an object, whose name is after those that were asked for before."""
        found: dict[Name, list[Row]] = {}
        for name, stream in self._streams.items():
            head = self._heads[name]
            found[name] = []
            if head is not None and object_id.startswith(head[0]):
                found[name] = head[1]
                self._heads[name] = next(stream, None)
        return found

    def _groups(self, name: Name) -> Iterator[tuple[str, list[Row]]]:
        key = "object_id" if name in (*OF_OBJECTS, "grasps") else "grasp_id"
        chosen, short = self.part.chosen, len(id_beginning("0" * 64, 0.0).split("-", maxsplit=1)[0])
        splits = sorted({each.split for each in chosen.manifest.of_table(name) if each.split})
        streams = [
            groupby(replace(chosen, split=split).rows(name), key=lambda row: str(row[key])[:short])
            for split in splits
        ]
        heads = [_next(stream) for stream in streams]
        while waiting := [head[0] for head in heads if head is not None]:
            first = min(waiting)
            for place, head in enumerate(heads):
                if head is not None and head[0] == first:
                    yield head
                    heads[place] = _next(streams[place])


def _next(stream: Iterator[tuple[str, Iterator[Row]]]) -> tuple[str, list[Row]] | None:
    found = next(stream, None)
    return None if found is None else (found[0], list(found[1]))
