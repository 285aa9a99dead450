"""Reads the datasets that are to be merged, and decides the settings that they have together."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from grasp_core.errors import InputError
from sim_validate.datasets.building.write_tables import QUARANTINE
from sim_validate.datasets.config import DatasetConfig
from sim_validate.datasets.learning.settings import BY_NAME
from sim_validate.datasets.open_dataset import Selection, select
from sim_validate.datasets.quarantine import read_left_out
from sim_validate.datasets.units import shared_settings

Row = Mapping[str, Any]


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """One dataset that is merged."""

    chosen: Selection
    config: DatasetConfig
    objects: Mapping[str, Row]
    """Rows of its objects, by their names."""
    gone: frozenset[tuple[str, float]]
    """Hashes of mesh files, with the frictions at which they have no rows."""

    def has(self, object_id: str, friction: float) -> bool:
        """Return whether the dataset has an object at a friction."""
        row = self.objects.get(object_id)
        if row is None or friction not in self.config.frictions:
            return False
        return (row["source_sha256"], friction) not in self.gone


def part_of(folder: Path) -> Part:
    """Open a dataset that is to be merged, and check its files.

    Raises:
        InputError: The dataset is not finished, or a file is not what was written.
    """
    chosen = select(folder)
    for name in chosen.tables:
        chosen.paths(name)  # raises if a file is not what was written
    # points and the like stay in their files until their object's turn
    kept = ("source_name", "source_sha256", "object_id", "split", "shape_class")
    objects = {
        row["object_id"]: {name: row[name] for name in kept if name in row}
        for row in chosen.rows("objects")
    }
    gone = {(each.source_sha256, each.friction) for each in read_left_out(folder / QUARANTINE)}
    return Part(chosen, chosen.config(), objects, frozenset(gone))


def merged_config(parts: Sequence[Part]) -> DatasetConfig:
    """Return the settings of the merged dataset.

    Raises:
        InputError: The datasets differ in more than objects, frictions and credits.
    """
    first = parts[0]
    for part in parts:
        if part.config.contacts:
            raise InputError(
                f"{part.chosen.folder}: this dataset judges given contacts, whose names are only "
                "its own; merge datasets of planned grasps"
            )
        differs = [
            name for name, value in _settings(part.config).items()
            if value != _settings(first.config).get(name)
        ]  # fmt: skip
        if differs or part.chosen.manifest.groups != first.chosen.manifest.groups:
            raise InputError(
                f"{part.chosen.folder}: this dataset was made with another {differs or 'learning'} "
                f"than {first.chosen.folder}; only objects, frictions and credits may differ"
            )
    configs = [part.config for part in parts]
    learning = first.config.learning
    if learning is not None:
        every = [each.learning for each in configs if each.learning is not None]
        learning = replace(learning, **{name: _union(every, name) for name in BY_NAME})
    return replace(
        first.config,
        objects=tuple(dict.fromkeys(name for each in configs for name in each.objects)),
        frictions=tuple(sorted({friction for each in configs for friction in each.frictions})),
        learning=learning,
    )


def _settings(config: DatasetConfig) -> dict[str, object]:
    """Return the settings that must be the same, with none about single objects."""
    if config.learning is not None:
        alone = {name: dict[str, Any]() for name in BY_NAME}
        config = replace(config, learning=replace(config.learning, **alone))
    found = shared_settings(config)
    return {**found, "execution": found.get("execution"), "learning": found.get("learning")}


def _union(every: Iterable[Any], table: str) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for each in every:
        for name, value in getattr(each, table).items():
            if found.setdefault(name, value) != value:
                raise InputError(
                    f"learning.{table}: two datasets have different values for {name}; their "
                    "objects need different names to be merged"
                )
    return found
