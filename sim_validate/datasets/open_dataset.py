"""A finished dataset, or one split of it: its tables as arrays, and what is known of its making."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from grasp_core.checked import one_of, path_of
from grasp_core.errors import InputError
from sim_validate.datasets.columns import TABLES, Name
from sim_validate.datasets.config import CREDITS, DatasetConfig, config_from_toml
from sim_validate.datasets.manifest import Listed, Manifest, listed, read_manifest
from sim_validate.datasets.parquet import Columns, each_row, read_columns
from sim_validate.datasets.rows import SPLITS
from sim_validate.files.paths import path_inside


@dataclass(frozen=True, slots=True)
class Selection:
    """A finished dataset, or the objects of one of its splits."""

    folder: Path
    manifest: Manifest
    split: str | None

    def paths(self, name: Name) -> list[Path]:
        """The files of a table, each whole.

        Raises:
            InputError: One is missing, or not what was written.
        """
        return [self._whole(each) for each in self._listed(name)]

    def counts(self) -> dict[Name, int]:
        """How many rows each table has."""
        return {name: sum(each.rows or 0 for each in self._listed(name)) for name in TABLES}

    def rows(self, name: Name) -> Iterator[dict[str, Any]]:
        """The rows of a table, not all in memory.

        Raises:
            InputError: A file is damaged, or has not as many rows as the manifest says.
        """
        for each in self._listed(name):
            found = 0
            for row in each_row(path_inside(self.folder, each.path), name):
                found += 1
                yield row
            if found != each.rows:
                raise InputError(f"{each.path}: {found} rows, listed are {each.rows}")

    def _whole(self, each: Listed) -> Path:
        """A file with the manifest's hash: page checksums do not cover all of it."""
        path = path_inside(self.folder, each.path)
        if not path.is_file():
            raise InputError(f"{path}: missing; see `graspproof dataset verify`")
        found = listed(self.folder, path)
        if (found.bytes, found.sha256) != (each.bytes, each.sha256):
            raise InputError(
                f"{path}: damaged, it is not what was written; see `graspproof dataset verify`"
            )
        return path

    def _listed(self, name: Name) -> list[Listed]:
        return [each for each in self.manifest.of_table(name) if self.split in (None, each.split)]

    def config(self) -> DatasetConfig:
        """What the dataset was made of.

        Raises:
            InputError: Its config.toml is damaged.
        """
        return config_from_toml(self.folder / "config.toml")

    def facts(self) -> dict[str, str]:
        """What made the dataset, and what people are to know, by name.

        Raises:
            InputError: Its config.toml is damaged.
        """
        config, manifest = self.config(), self.manifest
        stated = {name: str(getattr(config, name)) for name in CREDITS}
        return {
            **{name: text for name, text in stated.items() if text},
            "split": self.split or "all",
            "schema": str(manifest.schema),
            "config_sha256": manifest.config_sha256,
            **{f"version_{name}": text for name, text in sorted(manifest.versions.items())},
        }


def select(folder: Path, split: str | None = None) -> Selection:
    """A dataset or a part of it.

    Args:
        folder: Of the dataset.
        split: `train`, `validation` or `test`; everything if not given.

    Raises:
        InputError: There is no such split, or no finished dataset.
    """
    splits = [name for name, _ in SPLITS]
    if split is not None:
        one_of(split, splits, "split")
    return Selection(folder, read_manifest(folder), split)


def load_dataset(folder: str | Path, split: str | None = None) -> dict[Name, Columns]:
    """The tables of a dataset, each a dictionary of its columns.

    Args:
        folder: Of the dataset.
        split: `train`, `validation` or `test`; everything if not given.

    Returns:
        By table and column, arrays with a row per row: contact points, say, are (n, 4, 3) [m].
        Missing numbers are NaN, or -1 in columns of whole numbers; missing text is None.

    Raises:
        InputError: There is no such split, no finished dataset, or a file is damaged.
    """
    chosen = select(path_of(folder, "folder"), split)
    return {name: read_columns(chosen.paths(name), name) for name in TABLES}
