"""Runs the commands that show results: a grasp (`view`), a run as pages (`report`), a trial again.

The last is `replay`, which simulates one recorded trial again and writes its motion. `export`
writes grasps, or a hand in them, for other programs.
"""

import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from pkgutil import resolve_name

import numpy as np

from grasp_core.arrays import Array
from grasp_core.by_value import counted
from grasp_core.errors import InputError
from grasp_core.files.file_kinds import GRASPS, MANIFEST, REACHES
from grasp_core.files.records import record_of
from grasp_core.files.text_files import write_text
from grasp_core.messages import MICRO
from grasp_core.planning.grasps_json import load_grasps
from grasp_core.planning.result import Plan
from grasp_core.provenance import versions
from grasp_core.values import Grasp
from scenes import exports
from scenes.drawing.clips import GraphicsError, has_display, write_clip, write_trial_clip
from scenes.drawing.pages import turntable_page
from scenes.drawing.pictures import Drawing
from scenes.mujoco.closure_scene import Scene, build_scene, write_scene
from scenes.mujoco.mjcf_text import IDENTITY_POSE
from scenes.settings import FingerSettings
from sim_validate.closure.replaying import Recorded, Replayed, WantedTrial, recorded_in, replayed
from sim_validate.commands import flags, simulation_flags
from sim_validate.commands.console import Reporter
from sim_validate.commands.exit_codes import Exit, FlagsError
from sim_validate.engine.setup import with_planned_radius
from sim_validate.files.output_folders import alone_in
from sim_validate.planning.asked_objects import asked_grasps, grasp_with_id
from sim_validate.report.report import Report, write_report
from sim_validate.report.run_folder import RunFolder, folder_of, reaches_beside
from sim_validate.report.sections import why_not_held

COMING, FRAMES_RESTING = 60, 20
"""Number of clip frames in which fingers come in, and in which they then stay."""
SWING_DEG, CLIP_ELEVATION_DEG = 120.0, 25.0
"""Angle by which the camera moves around during a clip, and its elevation [deg]."""


def view_grasp(command: flags.ViewFlags, reporter: Reporter) -> int:
    """Show a grasp in MuJoCo's viewer, or write it to the files that are asked for."""
    path = command.grasps / GRASPS if command.grasps.is_dir() else command.grasps
    saved = load_grasps(path)
    if not saved.grasps:
        raise InputError(f"{path}: expected at least one grasp to show, found none")
    grasp = grasp_with_id(path, saved, command.grasp or saved.grasps[0].id)
    friction = saved.friction if command.friction is None else command.friction
    if friction <= grasp.critical_friction:
        reporter.warn(
            f"{grasp.id} is not in force closure at friction {friction:g}: it needs more than "
            f"{grasp.critical_friction:.4g}"
        )
    if command.picture is None and command.page is None and command.clip is None:
        _in_viewer(_scene(saved, grasp, friction), grasp, reporter)
        reporter.document({"id": grasp.id, "files": []})
        return Exit.GOOD
    reaches = reaches_beside(path.parent, saved) if command.hand else None
    found = RunFolder(path.parent, saved, friction, reaches=reaches).of(grasp)
    held = found.held or found.nearest
    if reaches is not None and found.held is None:
        shown = "not shown" if held is None else "shown where it came nearest"
        reporter.warn(f"the hand is {shown}: {why_not_held(found)}")
    drawing, files = Drawing(saved.body, grasp, friction, held), list[str]()

    def keep(path: Path) -> None:
        reporter.say(f"wrote {path}")
        files.append(str(path))

    if command.picture is not None:
        keep(drawing.sheet(legend=True).write(command.picture))
    if command.page is not None:
        keep(write_text(command.page, turntable_page(drawing)))
    if command.clip is not None:
        scene = _scene(saved, grasp, friction)
        joints = closing(scene)
        azimuths = np.linspace(0.0, SWING_DEG, len(joints))
        angles = np.column_stack([azimuths, np.full(len(joints), CLIP_ELEVATION_DEG)])
        keep(write_clip(scene, joints, command.clip, grasp.id, angles_deg=angles))
    reporter.document({"id": grasp.id, "files": files})
    return Exit.GOOD


def _scene(saved: Plan, grasp: Grasp, friction: float) -> Scene:
    fingers = with_planned_radius(FingerSettings(), saved.finger)
    return build_scene(saved.body, grasp, friction, fingers=fingers)


def _in_viewer(scene: Scene, grasp: Grasp, reporter: Reporter) -> None:
    if not has_display():
        raise InputError(
            "there is no display for MuJoCo's viewer (neither DISPLAY nor WAYLAND_DISPLAY is set): "
            "give --picture FILE.png, --page FILE.html or --clip FILE.webp"
        )
    reporter.say(f"{grasp.id} in MuJoCo's viewer; load the keyframe `approach` to see it close")
    with tempfile.TemporaryDirectory() as folder:
        path = write_text(Path(folder) / f"{grasp.id}.xml", scene.xml)
        # -P: modules of the working folder are not run
        command = [sys.executable, "-P", "-m", "mujoco.viewer", f"--mjcf={path}"]
        # the viewer writes its log where it runs
        ended = subprocess.run(command, cwd=folder, check=False).returncode  # noqa: S603 - MuJoCo's
    if ended:
        raise GraphicsError(
            f"MuJoCo's viewer failed with exit code {ended}; show the grasp with --picture, "
            "--page or --clip"
        )


def closing(scene: Scene) -> Array:
    """Return joint positions while fingertips come in along their lines and then stay."""
    layout = scene.layout
    away = np.einsum("kij,ki->kj", layout.frames, layout.approach).ravel()
    left = np.linspace(1.0, 0.0, COMING) ** 2
    slides = np.vstack([left[:, None] * away, np.zeros((FRAMES_RESTING, len(away)))])
    return np.column_stack([np.tile(IDENTITY_POSE, (len(slides), 1)), slides])


def report_folder(command: flags.ReportFlags, reporter: Reporter) -> int:
    """Write the results of a run as pages, and print where they are."""
    at = command.out or folder_of(command.folder)
    with alone_in(at if command.out or at.is_dir() else None):
        report = shown_report(command, reporter)
    reporter.document({"report": str(report.index), "grasps": report.grasps})
    return Exit.GOOD


def shown_report(asked: flags.ReportFlags, reporter: Reporter) -> Report:
    """Write the pages of a run, and say where they are."""

    def say_ready(index: Path, drawn: int, total: int) -> None:
        reporter.say(
            f"report: {index} can be opened now; {drawn} of {total} cards are drawn, "
            "the others follow"
        )

    with reporter.progress("drawing") as steps:
        report = write_report(
            asked.folder,
            asked.out,
            jobs=asked.jobs,
            limit=asked.limit,
            clips=asked.clips,
            progress=steps.update,
            ready=say_ready,
        )
    if report.no_clip:
        reporter.warn(f"no clips: {report.no_clip}")
    reporter.say(f"report: open {report.index} in a browser")
    return report


def export_grasps(command: simulation_flags.ExportFlags, reporter: Reporter) -> int:
    """Write the grasps of a file as one file of another program's format."""
    endings = simulation_flags.WRITTEN_ENDINGS[command.to]
    if command.out.suffix.lower() not in endings:
        raise FlagsError(
            f"--out must end in {' or '.join(endings)} with --to {command.to}, got {command.out}"
        )
    if command.to == "isaac" and command.fingertip_radius_m is not None:
        raise FlagsError(
            "--fingertip-radius-m is for fingertips without a hand: leave it out with --to isaac"
        )
    chosen = asked_grasps(command.grasps, reporter, grasp=command.grasp, limit=command.limit)
    if chosen is None:
        return Exit.NONE
    if command.to == "isaac":
        written = _export_hand(command, chosen, reporter)
    else:
        radius = command.fingertip_radius_m
        exports.export_grasps(chosen, command.out, fingertip_radius_m=radius)
        written = [grasp.id for grasp in chosen]
    if written:
        reporter.say(f"wrote {command.out} with {counted(len(written), 'grasp')}")
    out = str(command.out) if written else None
    reporter.document({"to": command.to, "out": out, "grasps": written})
    return Exit.GOOD if written else Exit.NONE


def _export_hand(
    command: simulation_flags.ExportFlags, chosen: Plan, reporter: Reporter
) -> list[str]:
    """Write the hand in the grasps in which it can open; return their names, none for no file."""
    from sim_validate.hands.isaac import BY_THE_HAND, isaac_text, reached_grasps  # slow to load

    path, folder = command.grasps, command.grasps.parent
    reaches = reaches_beside(folder, load_grasps(path))
    if reaches is None:
        raise InputError(
            f"{folder}: Isaac grasp files are of hands, so there must be a {REACHES} beside the "
            f"grasps; `graspproof reach {path} --hand HAND --out {folder}` writes one"
        )
    wanted = {grasp.id for grasp in chosen}
    asked = [each for each in reaches if each.id in wanted]
    found = reached_grasps(asked)
    reporter.say(
        f"of {counted(len(wanted), 'grasp')} the hand {reaches.hand.name} reaches "
        f"{sum(each.reach.reached for each in asked)}, and can open its fingers in {len(found)}"
    )
    if found:
        write_text(command.out, isaac_text(reaches.hand, chosen.body.name, found, BY_THE_HAND))
    return [each.name for each in found]


SHOWN_ROWS = 12


def replay_trial(command: flags.ReplayFlags, reporter: Reporter) -> int:
    """Simulate a recorded trial again and compare its outcome with that in the file."""
    if command.trial is not None and command.control is not None:
        raise InputError(
            "--trial chooses a repeat of the grasp with noise, --control a negative control: "
            "give only one of them"
        )
    source = command.source
    wanted = WantedTrial(command.grasp, command.control, command.trial, command.grasps)
    # the tables of datasets take a tenth of a second to declare, which no other command here needs
    read = recorded_in if not (source / MANIFEST).is_file() else resolve_name(
        "sim_validate.datasets.open_dataset:recorded_in_dataset"
    )  # fmt: skip
    recorded: Recorded = read(source, wanted)
    found = replayed(recorded, command.wrench)
    said = recorded.outcomes.get(found.name, recorded.others)
    _show(recorded, found, said, reporter)
    files = [] if command.out is None else list(_written(found, command, reporter))
    beside = {"recorded_outcome": said, "files": [str(path) for path in files]}
    reporter.document({"name": recorded.name, **record_of(found), **beside})
    return Exit.GOOD if found.hold.outcome.value == said else Exit.NEGATIVE


def _show(recorded: Recorded, found: Replayed, said: str | None, reporter: Reporter) -> None:
    trace, hold = found.watched.trace, found.hold
    step = max(1, len(trace.times_s) // SHOWN_ROWS)
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
    here = versions()["mujoco"]
    by = "" if recorded.mujoco in {None, here} else f", by MuJoCo {recorded.mujoco}; here: {here}"
    reporter.say(f"outcome: {ended} (the file says {said or 'nothing'}{by})")


def _written(found: Replayed, command: flags.ReplayFlags, reporter: Reporter) -> Iterator[Path]:
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
