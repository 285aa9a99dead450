"""Flags of the commands that merge datasets and show what they hold; imports nothing slow."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

from tyro.conf import OmitArgPrefixes, Positional

from sim_validate.cli.flag_bounds import at_least
from sim_validate.cli.flag_groups import Seed, Speech
from sim_validate.datasets.columns import SplitName


@dataclass(frozen=True, slots=True)
class Merge:
    """Merge finished datasets of the same settings; their objects and frictions may differ."""

    datasets: Positional[tuple[Path, ...]]
    """Folders of the datasets; of an object that several have, the first counts."""
    out: Path
    """Folder of the merged dataset; it must be empty or not exist."""
    speech: OmitArgPrefixes[Speech] = field(default_factory=Speech)


@dataclass(frozen=True, slots=True)
class Stats:
    """Count a dataset's rows by kind and outcome, and show how its numbers spread."""

    dataset: Positional[Path]
    """Folder of the dataset."""
    out: Path | None = None
    """Folder for a page with charts and for the numbers as JSON; if not given, only counts are
    printed."""
    split: SplitName | None = None
    """Count only the objects of this split; if not given, all objects."""
    speech: OmitArgPrefixes[Speech] = field(default_factory=Speech)


@dataclass(frozen=True, slots=True)
class SampleRows:
    """Show some rows of a dataset on a page, with pictures of their contacts."""

    dataset: Positional[Path]
    """Folder of the dataset."""
    out: Path
    """Folder for the page."""
    count: Annotated[int, at_least(1, up_to=1000)] = 50
    """Number of rows."""
    seed: Seed = 0
    """Seed of the random choice of the rows."""
    split: SplitName | None = None
    """Show only objects of this split; if not given, all objects."""
    speech: OmitArgPrefixes[Speech] = field(default_factory=Speech)
