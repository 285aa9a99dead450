"""Reads one contact set from a file or folder, with its settings and how its trials ended.

The source may be a grasps.json (then no outcome is recorded), a verdicts.json, the folder of a run,
a baseline, or a dataset.
"""

from dataclasses import replace
from pathlib import Path
from typing import Any, cast

from grasp_core.errors import InputError
from grasp_core.files.strict_json import value_of
from grasp_core.files.text_files import read_text
from sim_validate.baselines.baseline import read_baseline
from sim_validate.baselines.settings import of_settings, setup_for
from sim_validate.datasets.manifest import MANIFEST
from sim_validate.records.grasps import grasp_with_id, read_grasps, some
from sim_validate.replaying.from_dataset import from_dataset
from sim_validate.replaying.from_grasps import (
    grasps_behind,
    of_grasp,
    require_contacts,
    require_repeat,
)
from sim_validate.replaying.from_verdicts import from_verdicts
from sim_validate.replaying.recorded import Recorded, Wanted
from sim_validate.simulation.hold_verdict import Outcome
from sim_validate.simulation.setup import Agenda

VERDICTS = "verdicts.json"


def recorded_in(source: Path, wanted: Wanted) -> Recorded:
    """Read a contact set from a file or folder."""
    if wanted.trial is not None and wanted.control is not None:
        raise InputError(
            "--trial chooses a repeat of the grasp with noise, --control a negative control: "
            "give only one of them"
        )
    if source.is_dir() and (source / MANIFEST).is_file():
        return from_dataset(source, wanted)
    path = source / VERDICTS if source.is_dir() else source
    text = read_text(path)
    try:
        found = value_of(text)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    record = cast("dict[str, Any]", found) if isinstance(found, dict) else {}
    if "verdicts" in record:
        return from_verdicts(path, text, wanted)
    if "grasps_file" in record:
        return _from_baseline(path, wanted)
    if "object" in record and "grasps" in record:
        saved = read_grasps(path)
        if wanted.trial is not None:
            raise InputError(
                f"{path}: a file of grasps records no repeats with noise: for --trial give a "
                "verdicts.json or a baseline"
            )
        agenda = Agenda(seed=saved.seed)
        return of_grasp(path, saved, setup_for(saved, None), agenda, wanted)
    raise InputError(
        f"{path}: expected a baseline, verdicts or grasps as JSON, or the folder of a dataset"
    )


def _from_baseline(path: Path, wanted: Wanted) -> Recorded:
    baseline = read_baseline(path)
    grasps = wanted.grasps or path.parent / baseline.grasps_file
    saved = grasps_behind(grasps, baseline.content_sha256, baseline.friction)
    how = of_settings(baseline.settings, str(path))
    found = of_grasp(path, saved, how.setup, how.agenda, wanted)
    grasp = grasp_with_id(path, saved, wanted.grasp)
    entry = next((each for each in baseline.entries if each.id == grasp.id), None)
    if entry is None:
        there = some(each.id for each in baseline.entries)
        raise InputError(f"{path}: the baseline has no grasp {grasp.id}; it has {there}")
    require_contacts(path, grasp, entry.contacts_sha256)
    if wanted.control is not None:
        return found
    if wanted.trial is not None:
        require_repeat(path, wanted.trial, entry.noisy_trials)
        lost = wanted.trial in entry.noisy_not_held
        return found if lost else replace(found, others=Outcome.HELD.value)
    ends: dict[str, str | None] = dict.fromkeys(entry.not_held)
    if entry.not_held:
        ends[entry.not_held[0]] = entry.outcome.value
    return replace(found, outcomes=ends, others=Outcome.HELD.value)
