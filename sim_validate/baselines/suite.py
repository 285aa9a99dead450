"""Reads a `*.grasps.toml` file: which grasps must stay as stable as their baseline says.

The file names the grasps, the baseline and settings.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any

from grasp_core.errors import InputError, about
from grasp_core.kinds import RandomWrenches, Repeats, Seed
from grasp_core.planning.result import Plan
from grasp_core.settings import CHOSEN, Settings
from sim_validate.baselines.baseline import (
    Baseline,
    How,
    check_writable,
    read_baseline,
    write_baseline,
)
from sim_validate.baselines.check import (
    Checked,
    check_one,
    complete,
    demanded,
    measured,
    seen_from,
    setup_for,
    with_planned_fingers,
)
from sim_validate.baselines.part import (
    CARRY,
    IfChanged,
    Present,
    Source,
    present,
    source_of,
    testable,
)
from sim_validate.engine.setup import Agenda
from sim_validate.kit.toml_tables import read_tables
from sim_validate.planning.grasps_json import read_grasps
from sim_validate.planning.wrenches_json import wrenches_from_file
from sim_validate.settings.executions import ExecutionSettings
from sim_validate.settings.trials import LimitSearch, Noise

ENDING = ".grasps.toml"
GIVEN = ("limits", "random_wrenches", "repeats", "noise", "seed")
"""Settings that replace those of the agenda of the baseline."""


@dataclass(frozen=True, repr=False)
class Suite(Settings):
    """Grasps that must stay as stable as they were; a setting of None is the baseline's."""

    grasps: Path
    baseline: Path
    object: Path | None = None
    """The mesh file that the grasps were planned from; None to search beside them for the object's
    name."""
    strict: bool = False
    setup: Path | None = None
    wrenches: Path | None = None
    limits: LimitSearch | None = None
    """How the largest multiple of each wrench is found in simulation."""
    random_wrenches: RandomWrenches | None = None
    repeats: Repeats | None = None
    """Number of repeats with noise."""
    noise: Noise | None = None
    seed: Seed | None = None
    survives: bool = False
    execution: ExecutionSettings | None = None
    changed_part: IfChanged = CARRY
    path: Annotated[Path, CHOSEN] = Path(ENDING)
    """The file itself."""

    @cached_property
    def saved(self) -> Plan:
        """Read the grasps that the suite is about."""
        return read_grasps(self.grasps)

    @cached_property
    def source(self) -> Source:
        """Find the mesh file that the grasps were planned from."""
        folders = [self.path.parent]
        return source_of(self.saved, self.grasps, folders, self.object, self.asked.scale)

    @cached_property
    def asked(self) -> IfChanged:
        """Return what to do if the part has changed, with the scale of the baseline if it has one.

        A baseline that is refused is no reason to stop here, as it may be about to be replaced.
        """
        try:
            recorded = self.kept.scale
        except InputError:
            recorded = None
        return self.changed_part.with_scale(recorded)

    @cached_property
    def present(self) -> Present:
        """Carry the grasps over to their part as it is now."""
        return present(self.saved, self.grasps, self.source, self.asked)

    @cached_property
    def compared(self) -> Present:
        """Return the grasps on their part as it is now, compared with the part of the baseline."""
        return self.present.against(self.kept)

    @cached_property
    def kept(self) -> Baseline:
        """Read the baseline of the suite."""
        if not self.baseline.is_file():
            raise InputError(
                f"{self.baseline}: this baseline does not exist yet; write it with pytest "
                "--grasp-bless"
            )
        return read_baseline(self.baseline)

    @property
    def ids(self) -> list[str]:
        """List the ids of all grasps that are in the file or in the baseline."""
        kept = self.kept if self.baseline.is_file() else None
        ours = {grasp.id for grasp in self.saved.grasps[: kept and kept.limit]}
        return sorted(ours if kept is None else ours | {entry.id for entry in kept.entries})

    @property
    def where(self) -> str:
        """Path of the file of grasps, relative to the baseline's folder."""
        return seen_from(self.baseline, self.grasps)

    def tested(self, name: str) -> Checked:
        """Simulate one grasp again, and compare the result with the baseline."""
        now, before = self.compared, self.kept
        done = check_one(before, now, self.where, self._how(before), name)
        return demanded(done) if self.survives else done

    def bless(self) -> Baseline:
        """Simulate all grasps and write the results as the new baseline."""
        now = self.present
        check_writable(self.baseline)
        try:
            before = self.kept if self.baseline.is_file() else None
        except InputError as error:
            raise InputError(
                f"{error}; remove the file, then write a new baseline with pytest --grasp-bless"
            ) from error
        how = self._how(before)
        if before is not None:
            how = with_planned_fingers(how, before, now.saved)
        limit = before and before.limit
        done = measured(testable(now, limit), (self.where, limit), how)
        found = complete(done, now)
        write_baseline(self.baseline, found)
        return found

    def _how(self, before: Baseline | None) -> How:
        """Take the baseline's settings, or the default ones, replaced by those of the file."""
        if before is None:
            how = How(setup_for(self.saved, None), Agenda(seed=self.saved.seed))
        else:
            how = before.settings
        setup = how.setup if self.setup is None else setup_for(self.saved, self.setup)
        execution = how.execution if self.execution is None else self.execution
        if self.survives and execution is None:
            raise InputError(
                f"{self.path}: survives: expected a table [execution] too, which says how grasps "
                "are executed, but the file has none"
            )
        given: dict[str, Any] = {name: getattr(self, name) for name in GIVEN}
        if self.wrenches is not None:
            given["wrenches"] = wrenches_from_file(self.wrenches)
        asked = {name: value for name, value in given.items() if value is not None}
        with about(self.path):
            return How(setup, replace(how.agenda, **asked), execution)


def suite_from_toml(path: Path) -> Suite:
    """Read a `*.grasps.toml` file; paths in it are relative to its folder."""
    return suite_from_tables(read_tables(path), path)


def suite_from_tables(given: Mapping[str, Any], path: Path) -> Suite:
    """Build a suite from the settings of a `*.grasps.toml` file."""
    usual = path.name.removesuffix(ENDING) + ".baseline.json"
    with about(path):
        suite = Suite.of_table({"baseline": usual, **given})
    paths = {
        name: getattr(suite, name) for name in ("grasps", "object", "baseline", "setup", "wrenches")
    }
    found = {name: path.parent / value for name, value in paths.items() if value is not None}
    return replace(suite, path=path, **found)
