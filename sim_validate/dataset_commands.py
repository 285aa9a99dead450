"""The commands about datasets: to make one, to go on making it, to check and to export it."""

from dataclasses import asdict, fields
from pathlib import Path

from grasp_core.errors import InputError
from grasp_core.mesh import FORMATS
from grasp_core.requests import METHODS
from sim_validate import cli, flags
from sim_validate.console import TABLE_ROWS, Reporter
from sim_validate.datasets.build import build
from sim_validate.datasets.config import DatasetConfig, config_from_toml
from sim_validate.datasets.exports import export
from sim_validate.datasets.manifest import read_manifest
from sim_validate.datasets.redo import Sample
from sim_validate.datasets.tasks import Limits
from sim_validate.datasets.verify import verify
from sim_validate.engines import local_processes
from sim_validate.plan_command import say_cut

FRICTION = 0.5
"""Planned and tried at unless told otherwise."""
MEGABYTE = 2**20


def build_dataset(command: cli.DatasetBuild, reporter: Reporter) -> int:
    """Make a dataset."""
    config = _asked(command)
    memory = None if command.memory_mb is None else command.memory_mb * MEGABYTE
    limits = Limits(command.timeout_s, memory)
    with reporter.progress("building") as steps, local_processes(command.jobs) as engine:
        built = build(config, command.out, engine, steps.update, limits)
    counts = ", ".join(f"{count} {name}" for name, count in built.rows.items())
    reporter.say(
        f"{command.out}: {built.units} units, {built.made} made now, {built.quarantined} "
        f"quarantined; {counts}"
    )
    if built.quarantined:
        reporter.warn(f"{command.out / 'quarantine.jsonl'} says why objects were left out")
    reporter.document({"out": str(command.out), "manifest": asdict(read_manifest(command.out))})
    return cli.Exit.PARTIAL if built.quarantined else cli.Exit.GOOD


def verify_dataset(command: cli.DatasetVerify, reporter: Reporter) -> int:
    """Check a dataset."""
    sample = Sample(command.share, command.seed) if command.share > 0.0 else None
    faults = verify(command.dataset, sample)
    for fault in faults[:TABLE_ROWS]:
        reporter.warn(fault)
    say_cut(len(faults), reporter)
    reporter.say(
        f"{command.dataset}: {'nothing is wrong' if not faults else f'{len(faults)} faults'}"
    )
    reporter.document({"dataset": str(command.dataset), "faults": faults})
    return cli.Exit.NEGATIVE if faults else cli.Exit.GOOD


def export_dataset(command: cli.DatasetExport, reporter: Reporter) -> int:
    """Write a dataset in another format."""
    with reporter.progress("exporting") as steps:
        done = export(command.dataset, command.to, command.out, command.split, steps.update)
    counts = ", ".join(f"{count} {name}" for name, count in done.rows.items())
    reporter.say(f"{command.out}: {done.files} files, {counts}")
    if not done.rows["grasps"]:
        reporter.warn(f"{command.dataset}: no grasps in {command.split or 'it'}")
    asked = {"dataset": str(command.dataset), "to": command.to, "split": command.split}
    reporter.document({**asked, "out": str(command.out), **asdict(done)})
    return cli.Exit.GOOD


def _asked(command: cli.DatasetBuild) -> DatasetConfig:
    """What a TOML file or the flags say a dataset is made of.

    Raises:
        InputError: A setting or the file is refused, or there are flags beside a file.
    """
    first, settings = Path(command.objects[0]), command.settings
    if first.suffix == ".toml":
        if len(command.objects) > 1 or settings != flags.DatasetSettings():
            raise InputError(f"{first} says what the dataset is made of: give nothing beside it")
        return config_from_toml(first)
    given = {each.name: getattr(settings, each.name) for each in fields(settings)}
    frictions, families = given.pop("friction"), given.pop("family")
    return DatasetConfig(
        objects=_listed(command.objects),
        frictions=frictions or (FRICTION,),
        families=families or METHODS,
        **given,
    )


def _listed(names: tuple[str, ...]) -> tuple[str, ...]:
    """Objects by name; folders stand for the mesh files in them.

    Raises:
        InputError: A folder holds none.
    """
    found: list[str] = []
    for name in names:
        folder = Path(name)
        if not folder.is_dir():
            found.append(name)
            continue
        meshes = sorted(path for path in folder.iterdir() if path.suffix.lower()[1:] in FORMATS)
        if not meshes:
            raise InputError(f"{name}: holds no mesh file ({', '.join(FORMATS)})")
        found += map(str, meshes)
    return tuple(found)
