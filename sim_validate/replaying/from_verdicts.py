"""Reads contacts from a `verdicts.json`, with how their trials ended, to simulate them again."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from grasp_core.errors import InputError
from grasp_core.records.grasps_json import SavedGrasps
from sim_validate.baselines.settings import noise_from_table
from sim_validate.records.grasps import grasp_with_id, some
from sim_validate.records.setup_toml import OF_USERS, setup_from_tables
from sim_validate.records.verdicts import verdicts_of
from sim_validate.replaying.from_grasps import (
    grasps_behind,
    of_grasp,
    require_contacts,
    require_repeat,
)
from sim_validate.replaying.recorded import Recorded, Wanted
from sim_validate.simulation.hold_verdict import Outcome
from sim_validate.simulation.noise import Noise
from sim_validate.simulation.setup import AXIS_NAMES, RANDOM, WEAKEST, Agenda, NamedWrench, Setup

GRASPS = "grasps.json"


def from_verdicts(path: Path, text: str, wanted: Wanted) -> Recorded:
    """Read a grasp, a negative control or a repeat with noise from a `verdicts.json`."""
    try:
        record = verdicts_of(text)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    grasps = wanted.grasps or path.parent / GRASPS
    saved = grasps_behind(grasps, record["object"]["content_sha256"], record["friction"])
    verdicts = {each["id"]: each for each in record["verdicts"]}
    grasp = grasp_with_id(path, saved, wanted.grasp)
    if grasp.id not in verdicts:
        raise InputError(
            f"{path}: no verdict on the grasp {grasp.id}; the file has verdicts on {some(verdicts)}"
        )
    return of_verdict(path, saved, verdicts[grasp.id], replace(wanted, grasp=grasp.id))


def of_verdict(
    path: Path, saved: SavedGrasps, verdict: Mapping[str, Any], wanted: Wanted
) -> Recorded:
    """Read a contact set from the verdict on one grasp."""
    grasp = grasp_with_id(path, saved, wanted.grasp)
    require_contacts(path, grasp, verdict["contacts_sha256"])
    setup, agenda = _asked(path, verdict)
    found = of_grasp(path, saved, setup, agenda, wanted)
    return _with_outcomes(path, found, verdict, wanted)


def _asked(path: Path, verdict: Mapping[str, Any]) -> tuple[Setup, Agenda]:
    """Rebuild the settings and the choice of trials that a verdict was made with."""
    settings = verdict["settings"]
    tables = {name: settings[name] for name in OF_USERS}
    setup = setup_from_tables(tables, Setup(surface=settings["surface"]), str(path))
    count = settings["random_wrenches"]
    ours = {*AXIS_NAMES, WEAKEST, *(RANDOM.format(place) for place in range(count))}
    repeats = verdict.get("robustness")
    agenda = Agenda(
        random_wrenches=count,
        wrenches=tuple(
            NamedWrench(each["name"], each["wrench"])
            for each in verdict["wrenches"]
            if each["name"] not in ours
        ),
        noise=Noise() if repeats is None else noise_from_table(repeats["noise"]),
        seed=settings["seed"],
    )
    return setup, agenda


def _with_outcomes(
    path: Path, found: Recorded, verdict: Mapping[str, Any], wanted: Wanted
) -> Recorded:
    """Add to a contact set how its trials ended."""
    if wanted.trial is not None:
        nothing: Mapping[str, Any] = {"trials": 0, "not_held": []}
        repeats: Mapping[str, Any] = verdict.get("robustness") or nothing
        require_repeat(path, wanted.trial, repeats["trials"])
        for each in repeats["not_held"]:
            if each["trial"] == wanted.trial:
                return replace(found, outcomes={each["wrench"]: each["outcome"]})
        return replace(found, others=Outcome.HELD.value)
    tried = verdict if wanted.control is None else verdict["controls"][wanted.control]
    return replace(found, outcomes={each["name"]: each["outcome"] for each in tried["wrenches"]})
