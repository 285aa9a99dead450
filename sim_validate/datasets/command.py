"""Runs the commands that build, import, verify and export datasets."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from grasp_core.by_value import counted
from grasp_core.errors import InputError
from grasp_core.files.file_kinds import QUARANTINE
from grasp_core.files.records import record_of
from grasp_core.mesh_files.limits import MESH_FORMATS
from grasp_core.settings import extended
from sim_validate.commands.console import TABLE_ROWS, Reporter, say_cut
from sim_validate.commands.exit_codes import Exit
from sim_validate.datasets import flags as dataset_flags
from sim_validate.datasets.build import build
from sim_validate.datasets.clusters import workers_of
from sim_validate.datasets.config import (
    CREDITS,
    DatasetConfig,
    DatasetHand,
    Learning,
    PlannedContent,
    config_from_toml,
)
from sim_validate.datasets.isaac import export
from sim_validate.datasets.layout import CARD, CONFIG
from sim_validate.datasets.open_dataset import splits_in_words
from sim_validate.datasets.verify import verify


def build_dataset(command: dataset_flags.BuildFlags, reporter: Reporter) -> int:
    """Make a dataset, or resume a build that was interrupted."""
    config = _configuration(command)
    return _build(config, command.out, command.work, reporter)


def _configuration(command: dataset_flags.BuildFlags) -> DatasetConfig:
    first = Path(command.objects[0]) if command.objects else Path()
    if first.suffix != ".toml":
        learning = None if command.learning == Learning() else command.learning
        hand = None if command.hand == DatasetHand() else command.hand
        objects = _listed(command.objects)
        return extended(
            DatasetConfig, command.content, objects=objects, learning=learning, hand=hand
        )
    if len(command.objects) > 1 or (command.content, command.learning, command.hand) != (
        PlannedContent(), Learning(), DatasetHand(),
    ):  # fmt: skip
        raise InputError(
            f"{first} holds all settings of the dataset: give no other objects and no flags but "
            "--out beside it"
        )
    config = config_from_toml(first)
    return replace(config, objects=_listed(config.objects))


def import_dataset(command: dataset_flags.ImportFlags, reporter: Reporter) -> int:
    """Judge the grasps of another tool, and write the results as a dataset."""
    config = extended(
        DatasetConfig, command.content, objects=(command.object,), contacts=str(command.contacts),
        outward=command.outward,
    )  # fmt: skip
    return _build(config, command.out, command.work, reporter)


def _build(
    config: DatasetConfig, out: Path, work: dataset_flags.Working, reporter: Reporter
) -> int:
    _warn(config, reporter)
    workers = workers_of(work.engine, work.jobs, work.address)
    with reporter.progress("building") as steps, workers as engine:
        built = build(config, out, engine, steps.update, work.timeout_s)
    manifest, rows = built.manifest, built.manifest.rows
    before, filled = manifest.units - built.made, manifest.units - manifest.quarantined
    reporter.say(
        f"{out}: {counted(manifest.units, 'unit')} ({built.made} made now, {before} before): "
        f"{filled} with rows, {manifest.quarantined} quarantined; "
        f"{counted(rows['objects'], 'object')}, {rows['grasps']} grasps and controls, "
        f"{rows['trials']} trials"
        + (f", {rows['executions']} trials of executions" if config.execution else "")
    )
    reporter.say(splits_in_words(manifest))
    if manifest.quarantined:
        reporter.warn(f"{out / QUARANTINE} says why objects were left out")
    reporter.document(
        {"out": str(out), "manifest": {"schema": manifest.SCHEMA, **record_of(manifest)}}
    )
    return Exit.PARTIAL if manifest.quarantined else Exit.GOOD


def verify_dataset(command: dataset_flags.VerifyFlags, reporter: Reporter) -> int:
    """Check a dataset and list its faults."""
    faults = verify(command.dataset, command.share, command.seed)
    return tell_faults(command.dataset, faults, reporter)


def tell_faults(folder: Path, faults: Sequence[str], reporter: Reporter) -> int:
    """List the faults of a folder that was checked."""
    for fault in faults[:TABLE_ROWS]:
        reporter.warn(fault)
    say_cut(len(faults), reporter)
    reporter.say(f"{folder}: {'nothing is wrong' if not faults else f'faults: {len(faults)}'}")
    reporter.document({"dataset": str(folder), "faults": [*faults]})
    return Exit.NEGATIVE if faults else Exit.GOOD


def export_dataset(command: dataset_flags.ExportFlags, reporter: Reporter) -> int:
    """Write the poses of a dataset's hand as Isaac grasp files."""
    with reporter.progress("exporting") as steps:
        done = export(command.dataset, command.out, command.split, steps.update)
    grasps, objects = counted(done["grasps"], "grasp"), counted(done["objects"], "object")
    reporter.say(f"{command.out}: {grasps} of {objects}, a file for each object")
    if closed := done["never_opens"]:
        reporter.say(f"left out, as the hand cannot open its fingers: {counted(closed, 'grasp')}")
    if not done["grasps"]:
        where = f"the split {command.split}" if command.split else "the dataset"
        reporter.warn(f"{command.dataset}: {where} has no grasp that the hand reaches and opens in")
    asked = {"dataset": str(command.dataset), "split": command.split, "out": str(command.out)}
    reporter.document({**asked, **done})
    return Exit.GOOD


def _warn(config: DatasetConfig, reporter: Reporter) -> None:
    """Warn of what a dataset will lack or give away, as that cannot be changed later."""
    hand = "" if config.hand is None else config.hand.hand
    paths = (*config.objects, config.contacts, hand)
    absolute = [name for name in paths if Path(name).is_absolute()]
    if absolute and not reporter.quiet:
        reporter.warn(
            f"{CONFIG} and {CARD} will hold the path {absolute[0]}, so they differ on a machine "
            "with other folders: give relative paths"
        )
    missing = [name for name in CREDITS if not getattr(config, name)]
    if missing and not reporter.quiet:
        given = ", ".join(f"--{name}" for name in missing)
        reporter.warn(
            f"{CARD} will lack {', '.join(missing)}, which data catalogues ask for: give {given}, "
            "or the same settings in a TOML file"
        )


def _listed(names: tuple[str, ...]) -> tuple[str, ...]:
    found: list[str] = []
    if not names:
        raise InputError(
            "objects: expected at least one mesh file, folder of mesh files, or built-in object"
        )
    for name in names:
        folder = Path(name)
        if not folder.is_dir():
            found.append(name)
            continue
        meshes = sorted(
            path for path in folder.iterdir()
            if path.suffix.lower()[1:] in MESH_FORMATS and not path.name.startswith(".")
        )  # fmt: skip
        if not meshes:
            raise InputError(f"{name}: this folder holds no mesh file ({', '.join(MESH_FORMATS)})")
        found += map(str, meshes)
    return tuple(found)
