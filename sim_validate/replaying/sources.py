"""A file or folder -> one contact set with its settings and how its trials ended.

It may be a grasps.json (nothing is recorded then), a verdicts.json, the folder of a run, a
baseline, or a dataset.
"""

import json
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

from grasp_core.critical import critical_friction
from grasp_core.errors import InputError
from grasp_core.given_contacts import seat
from grasp_core.records import SavedGrasps, grasps_from_json
from grasp_core.values import Contact, Grasp
from sim_validate.baselines.baseline_file import baseline_from_json
from sim_validate.baselines.measuring import of_settings, setup_for
from sim_validate.controls import negative_controls
from sim_validate.datasets.manifest import MANIFEST
from sim_validate.datasets.meshes import stored_body
from sim_validate.datasets.rows import GIVEN, NOT_TRIED
from sim_validate.datasets.selection import Selection, select
from sim_validate.files import read_text
from sim_validate.noise import Noise
from sim_validate.replaying.values import Recorded, Wanted
from sim_validate.setup import AXIS_NAMES, RANDOM, WEAKEST, Agenda, NamedWrench, Setup
from sim_validate.setup_file import OF_USERS, setup_from_tables

VERDICTS, GRASPS = "verdicts.json", "grasps.json"
NAMED = 5
"""Names that a message lists."""


def recorded_in(source: Path, wanted: Wanted) -> Recorded:
    """What a file or folder says about a contact set.

    Args:
        source: The file or folder.
        wanted: Which contact set.

    Raises:
        InputError: It is none of these, or does not hold what is wanted; the message lists what
            there is.
    """
    if source.is_dir() and (source / MANIFEST).is_file():
        return _from_dataset(source, wanted)
    path = source / VERDICTS if source.is_dir() else source
    text = read_text(path)
    try:
        found: object = json.loads(text)
    except json.JSONDecodeError as error:
        raise InputError(f"{path}: not JSON ({error})") from error
    record = cast("dict[str, Any]", found) if isinstance(found, dict) else {}
    if "verdicts" in record:
        return _from_verdicts(path, record, wanted)
    if "grasps_file" in record:
        return _from_baseline(path, text, wanted)
    if "object" in record and "grasps" in record:
        saved = grasps_from_json(text)
        agenda = Agenda(seed=saved.seed)
        return _of_grasp(path, saved, setup_for(saved, None), agenda, wanted)
    raise InputError(
        f"{path}: expected a baseline, verdicts or grasps as JSON, or the folder of a dataset"
    )


def _from_baseline(path: Path, text: str, wanted: Wanted) -> Recorded:
    baseline = baseline_from_json(text, str(path))
    saved = _saved(wanted.grasps or path.parent / baseline.grasps_file, baseline.content_sha256)
    saved = SavedGrasps(saved.body, baseline.friction, saved.seed, saved.grasps, saved.finger)
    setup, agenda = of_settings(baseline.settings, str(path))
    found = _of_grasp(path, saved, setup, agenda, wanted)
    entry = next((each for each in baseline.entries if each.id == found.name), None)
    if entry is None:  # a control, or a repeat with noise: a baseline has only how many held
        return found
    if entry.held:
        return replace(found, others=entry.outcome)
    return replace(found, outcomes={entry.first_failure: entry.outcome})


def _from_verdicts(path: Path, record: Mapping[str, Any], wanted: Wanted) -> Recorded:
    try:
        saved = _saved(
            wanted.grasps or path.parent / GRASPS, str(record["object"]["content_sha256"])
        )
        friction = float(record["friction"])
        saved = SavedGrasps(saved.body, friction, saved.seed, saved.grasps, saved.finger)
        verdicts = {str(each["id"]): each for each in record["verdicts"]}
        grasp = _chosen(path, saved, wanted)
        if grasp.id not in verdicts:
            raise InputError(f"{path}: no verdict on {grasp.id}; there is {_some(verdicts)}")
        verdict = verdicts[grasp.id]
        setup, agenda = _asked(path, verdict)
        found = _of_grasp(path, saved, setup, agenda, replace(wanted, grasp=grasp.id))
        return _with_outcomes(found, verdict, wanted)
    except (KeyError, TypeError, AttributeError) as error:
        raise InputError(f"{path}: is not what `graspproof validate` writes ({error!r})") from error


def _asked(path: Path, verdict: Mapping[str, Any]) -> tuple[Setup, Agenda]:
    """How a verdict's trials were simulated, and which ones."""
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
        noise=Noise() if repeats is None else Noise(**repeats["noise"]),
        seed=settings["seed"],
    )
    return setup, agenda


def _with_outcomes(found: Recorded, verdict: Mapping[str, Any], wanted: Wanted) -> Recorded:
    """The same with how its trials ended."""
    if wanted.trial is not None:
        repeats = verdict["robustness"]
        if repeats is None or wanted.trial >= repeats["trials"]:
            return found
        for each in repeats["not_held"]:
            if each["trial"] == wanted.trial:
                return replace(found, outcomes={each["wrench"]: each["outcome"]})
        return replace(found, others="held")
    tried = verdict if wanted.control is None else verdict["controls"][wanted.control]
    return replace(found, outcomes={each["name"]: each["outcome"] for each in tried["wrenches"]})


def _of_grasp(
    path: Path, saved: SavedGrasps, setup: Setup, agenda: Agenda, wanted: Wanted
) -> Recorded:
    """A grasp of a file, or a control made from it."""
    grasp = _chosen(path, saved, wanted)
    found = Recorded(
        grasp.id, saved.body, grasp.contacts, saved.friction, setup, agenda,
        grasp=grasp, trial=wanted.trial,
    )  # fmt: skip
    if wanted.trial is not None:
        return replace(found, name=f"{grasp.id} in trial {wanted.trial}")
    if wanted.control is None:
        return found
    exact = replace(grasp, critical_friction=critical_friction(grasp))
    controls = {
        each.name: each
        for each in negative_controls(saved.body, exact, saved.friction, agenda.seed)
    }
    if wanted.control not in controls:
        raise InputError(
            f"{path}: {grasp.id} has no control {wanted.control!r}; there is {_some(controls)}"
        )
    control = controls[wanted.control]
    return replace(
        found,
        name=f"{grasp.id}:{control.name}",
        contacts=control.contacts,
        friction=control.friction,
        control=control.name,
        grasp=None,
    )


def _from_dataset(folder: Path, wanted: Wanted) -> Recorded:
    chosen = select(folder)
    if wanted.grasp is None or wanted.trial is not None or wanted.grasps is not None:
        raise InputError(f"{folder}: give --grasp GRASP_ID of its table of grasps, and no --trial")
    name = wanted.grasp if wanted.control is None else f"{wanted.grasp}:{wanted.control}"
    row = next((row for row in chosen.rows("grasps") if row["grasp_id"] == name), None)
    if row is None or row["outcome"] == NOT_TRIED:
        raise InputError(f"{folder}: {name} is no grasp or control of it that was tried")
    config = chosen.config()
    contacts = [
        Contact(point, normal)
        for point, normal in zip(row["contact_points_m"], row["contact_normals"], strict=True)
        if point[0] is not None
    ]
    source = _source_name(chosen, row["object_id"])
    body = stored_body(folder, row["object_id"], source, config.faces)
    if row["label"] == GIVEN:  # on curved surfaces such contacts have faces of their own
        body = seat(body, row["contact_points_m"], row["contact_normals"]).body
    return Recorded(
        name=name,
        body=body,
        contacts=tuple(contacts),
        friction=row["friction"],
        setup=Setup(),
        agenda=Agenda(random_wrenches=config.random_wrenches, seed=config.seed),
        control=None if row["force_closed"] else str(row["label"]),
        outcomes={
            each["name"]: each["outcome"]
            for each in chosen.rows("trials")
            if each["grasp_id"] == name
        },
    )


def _source_name(chosen: Selection, object_id: str) -> str:
    rows = chosen.rows("objects")
    return next((row["source_name"] for row in rows if row["object_id"] == object_id), object_id)


def _saved(path: Path, content_sha256: str) -> SavedGrasps:
    """The grasps behind a file.

    Raises:
        InputError: They are missing, or of another object.
    """
    if not path.is_file():
        raise InputError(f"{path}: the grasps are not there; name their file with --grasps")
    saved = grasps_from_json(read_text(path))
    if saved.body.content_sha256 != content_sha256:
        raise InputError(f"{path}: its object is another one than that of the file to replay")
    return saved


def _chosen(path: Path, saved: SavedGrasps, wanted: Wanted) -> Grasp:
    if wanted.grasp is None and len(saved.grasps) == 1:
        return saved.grasps[0]
    found = next((grasp for grasp in saved.grasps if grasp.id == wanted.grasp), None)
    if found is None:
        asked = "give --grasp ID" if wanted.grasp is None else f"no grasp {wanted.grasp}"
        raise InputError(f"{path}: {asked}; there is {_some(grasp.id for grasp in saved.grasps)}")
    return found


def _some(names: Iterable[str]) -> str:
    listed = list(names)
    more = f" and {len(listed) - NAMED} more" if len(listed) > NAMED else ""
    return (", ".join(listed[:NAMED]) or "none") + more
