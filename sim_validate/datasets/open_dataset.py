"""Reads a finished dataset, or one split of it: its tables as arrays, or row by row.

All tables are sorted by the beginning of their rows' names, which are the first letters of the
object's hash, so that rows can be read grouped by object, with only one object in memory.
"""

import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any

from grasp_core.checked import one_of, path_of
from grasp_core.errors import InputError
from sim_validate.datasets.columns import RowOf, row_of
from sim_validate.datasets.config import CREDITS, DatasetConfig, config_from_toml
from sim_validate.datasets.manifest import Listed, Manifest, listed, read_manifest
from sim_validate.datasets.parquet import Columns, each_batch, read_columns
from sim_validate.datasets.rows import ROWS, Rows, Tables
from sim_validate.datasets.tables import KEYS, SHORT, SPLITS, Name
from sim_validate.kit.files import path_inside


@dataclass(frozen=True, slots=True)
class Selection:
    """A finished dataset, or the objects of one of its splits."""

    folder: Path
    manifest: Manifest
    split: str | None

    @property
    def tables(self) -> Tables:
        """Tables of the dataset, with their columns."""
        return self.manifest.tables

    def paths(self, name: Name) -> list[Path]:
        """List the files of a table, each checked to be unchanged."""
        return [self._whole(each) for each in self._listed(name)]

    def counts(self) -> dict[Name, int]:
        """Number of rows of each table."""
        return {name: sum(each.rows or 0 for each in self._listed(name)) for name in self.tables}

    def rows(self, kind: type[RowOf], **cells: str | bool) -> Iterator[RowOf]:
        """Yield rows of a class, or those with some cells, without holding all in memory."""
        name: Name = next(name for name, each in ROWS.items() if each is kind)
        for each in self._listed(name):
            found = 0
            for batch in each_batch(path_inside(self.folder, each.path), name, self.tables):
                for number, row in enumerate(batch.to_pylist(), start=found):
                    if cells == {column: row[column] for column in cells}:
                        yield row_of(kind, row, f"{each.path}: row {number}")
                found += batch.num_rows
            if found != each.rows:
                raise InputError(
                    f"{each.path}: the file has {found} rows, but the manifest lists {each.rows}; "
                    "see `graspproof dataset verify`"
                )

    def _whole(self, each: Listed) -> Path:
        """Check that a file has the manifest's hash, as page checksums miss some bytes."""
        path = path_inside(self.folder, each.path)
        if not path.is_file():
            raise InputError(
                f"{path}: this file of the dataset is missing; see `graspproof dataset verify`"
            )
        found = listed(self.folder, path)
        if (found.bytes, found.sha256) != (each.bytes, each.sha256):
            raise InputError(
                f"{path}: this file of the dataset differs from what was written; see `graspproof "
                "dataset verify`"
            )
        return path

    def _listed(self, name: Name) -> list[Listed]:
        return [each for each in self.manifest.of_table(name) if self.split in (None, each.split)]

    def config(self) -> DatasetConfig:
        """Read the configuration of the dataset."""
        return config_from_toml(self.folder / "config.toml")

    def facts(self) -> dict[str, str]:
        """Versions and settings that made the dataset, and statements on its origin, by name."""
        config, manifest = self.config(), self.manifest
        stated = {name: str(getattr(config, name)) for name in CREDITS}
        return {
            **{name: text for name, text in stated.items() if text},
            "split": self.split or "all",
            "schema": str(manifest.SCHEMA),
            "config_sha256": manifest.config_sha256,
            **{f"version_{name}": text for name, text in sorted(manifest.versions.items())},
        }


def select(folder: Path, split: str | None = None) -> Selection:
    """Open a dataset or one of its splits."""
    if split is not None:
        one_of(split, [name for name, _ in SPLITS], "split")
    return Selection(folder, read_manifest(folder), split)


def splits_in_words(manifest: Manifest) -> str:
    """Say how many objects each split has."""
    files = manifest.of_table("objects")
    counts = [
        f"{split} {sum(each.rows or 0 for each in files if each.split == split)}"
        for split, _ in reversed(SPLITS)
    ]
    return f"{', '.join(counts)} objects"


def load_dataset(folder: str | Path, split: str | None = None) -> dict[Name, Columns]:
    """Read the tables of a dataset, each as a dictionary of its columns.

    Args:
        folder: Folder of the dataset.
        split: `train`, `validation` or `test`; all splits if not given.

    Returns:
        Arrays by table and column, with one entry per row: contact points, for example, are (n, 4,
        3) [m]. Missing numbers are NaN, or -1 in columns of whole numbers; missing text is None.
        Columns of truth values are bool; with missing values they are 1.0, 0.0 and NaN.

    Warns:
        UserWarning: The split has no objects, as splits of small datasets often do.

    Raises:
        InputError: The split is unknown, the dataset is not finished, or a file is damaged.
    """
    chosen = select(path_of(folder, "folder"), split)
    if split is not None and not chosen.counts()["objects"]:
        warnings.warn(
            f"{folder}: the split {split} has no objects; the dataset has "
            f"{splits_in_words(chosen.manifest)}. Another seed splits the objects in another way, "
            "and docs/datasets.md says how to choose",
            stacklevel=2,
        )
    return {name: read_columns(chosen.paths(name), name, chosen.tables) for name in chosen.tables}


def by_object(chosen: Selection) -> Iterator[Rows]:
    """Yield the rows of each object in turn."""
    streams = {name: _groups(chosen, name) for name in chosen.tables}
    heads = {name: next(streams[name], None) for name in chosen.tables}
    while waiting := [head[0] for head in heads.values() if head is not None]:
        first = min(waiting)
        own = {name: head[1] for name, head in heads.items() if head and head[0] == first}
        yield Rows(**own)
        heads |= {name: next(streams[name], None) for name in own}


def _groups(chosen: Selection, name: Name) -> Iterator[tuple[str, tuple[Any, ...]]]:
    """Yield rows grouped by the part of their first key that all rows of an object share."""
    key = KEYS[name][0]
    beginnings = groupby(chosen.rows(ROWS[name]), key=lambda row: str(getattr(row, key))[:SHORT])
    for beginning, rows in beginnings:
        yield beginning, tuple(rows)
