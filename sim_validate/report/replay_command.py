"""Runs the command `replay`, which simulates one recorded trial again and writes its motion."""

from collections.abc import Iterator
from pathlib import Path

from grasp_core.errors import InputError
from grasp_core.files.records import record_of
from grasp_core.files.text_files import write_text
from scenes.drawing.clips import GraphicsError, write_trial_clip
from scenes.mujoco.closure_scene import write_scene
from sim_validate.closure.replaying import Recorded, Replayed, Wanted, recorded_in, replayed
from sim_validate.datasets.manifest import MANIFEST
from sim_validate.datasets.open_dataset import recorded_in_dataset
from sim_validate.kit import command_flags
from sim_validate.kit.console import Reporter
from sim_validate.kit.exit_codes import Exit

SHOWN = 12
"""Number of rows of the motion that are shown; the trace file has all of them."""
MICRO = 1e6


def replay_trial(command: command_flags.Replay, reporter: Reporter) -> int:
    """Simulate a recorded trial again and compare its outcome with that in the file."""
    wanted = Wanted(command.grasp, command.control, command.trial, command.grasps)
    recorded = _recorded(command.source, wanted)
    found = replayed(recorded, command.wrench)
    said = recorded.outcome_of(found.name)
    _show(recorded, found, said, reporter)
    files = [] if command.out is None else list(_written(found, command, reporter))
    beside = {"recorded_outcome": said, "files": [str(path) for path in files]}
    reporter.document({"name": recorded.name, **record_of(found), **beside})
    return Exit.GOOD if found.hold.outcome.value == said else Exit.NEGATIVE


def _recorded(source: Path, wanted: Wanted) -> Recorded:
    """Read a contact set from a `verdicts.json`, the folder of a run, or a dataset."""
    if wanted.trial is not None and wanted.control is not None:
        raise InputError(
            "--trial chooses a repeat of the grasp with noise, --control a negative control: "
            "give only one of them"
        )
    if source.is_dir() and (source / MANIFEST).is_file():
        return recorded_in_dataset(source, wanted)
    return recorded_in(source, wanted)


def _show(recorded: Recorded, found: Replayed, said: str | None, reporter: Reporter) -> None:
    trace, hold = found.watched.trace, found.hold
    step = max(1, len(trace.times_s) // SHOWN)
    rows = [
        (f"{trace.times_s[row]:.3f}",
         *(f"{MICRO * value[row]:.3g}" for value in (trace.displacements_m, trace.rotations_rad)),
         *(f"{MICRO * value[row].max():.3g}" for value in (trace.slips_m, trace.gaps_m)))
        for row in range(0, len(trace.times_s), step)
    ]  # fmt: skip
    columns = ("s", "um moved", "urad turned", "most um slid", "most um off a face")
    reporter.table(f"{recorded.name}: {found.name}, once friction is lowered", columns, rows)
    reporter.say(
        "off a face: below zero fingertips press on their faces, which the simulator lets them "
        "enter by that much"
    )
    limit = found.predicted_limit
    predicted = "no forces resist it" if limit is None else f"{limit:.4g} times it is resisted"
    needs = found.required_friction
    friction = "no forces balance it" if needs is None else f"the planned forces need {needs:.4g}"
    reporter.say(f"wrench {found.load.wrench.tolist()} (N, N m): by analysis {predicted}")
    reporter.say(f"simulated with friction {found.friction:.6g}: {friction}")
    ended = f"{hold.outcome.value}{f': {hold.reason}' if hold.reason else ''}"
    reporter.say(f"outcome: {ended} (the file says {said or 'nothing'})")


def _written(found: Replayed, command: command_flags.Replay, reporter: Reporter) -> Iterator[Path]:
    folder = command.out or Path()
    folder.mkdir(parents=True, exist_ok=True)
    yield write_scene(found.scene, folder / "scene.xml")
    yield write_text(folder / "trace.csv", trace_text(found))
    name = f"{found.name}: {found.hold.outcome.value}"
    try:
        yield write_trial_clip(found.scene, found.watched.joints, folder / "clip.gif", name)
    except GraphicsError as error:
        reporter.warn(f"no clip: {error}")
    reporter.say(f"wrote {folder}")


def trace_text(found: Replayed) -> str:
    """Write the motion as CSV, one row for each sample from when friction was lowered."""
    trace = found.watched.trace
    fingers = range(trace.slips_m.shape[1])
    names = ["time_s", "displacement_m", "shift_m", "rotation_rad",
             *(f"slip{finger}_m" for finger in fingers),
             *(f"gap{finger}_m" for finger in fingers)]  # fmt: skip
    table = (
        trace.times_s, trace.displacements_m, trace.shifts_m, trace.rotations_rad,
        *trace.slips_m.T, *trace.gaps_m.T,
    )  # fmt: skip
    rows = [",".join(repr(float(value)) for value in row) for row in zip(*table, strict=True)]
    return "\n".join([",".join(names), *rows]) + "\n"
