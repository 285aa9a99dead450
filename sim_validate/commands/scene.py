"""Runs the command `scene`, which writes grasps as MuJoCo scenes."""

from grasp_core.errors import InputError
from scenes.mjcf import build_scene
from sim_validate.cli import command_flags
from sim_validate.cli.console import Reporter
from sim_validate.cli.exit_codes import Exit
from sim_validate.commands.asked_trials import finger_settings
from sim_validate.files.folder_lock import alone_in
from sim_validate.files.reading import write_text
from sim_validate.records.grasps import grasp_with_id, read_grasps
from sim_validate.simulation.setup import with_planned_radius


def write_scenes(command: command_flags.Scene, reporter: Reporter) -> int:
    """Write a MuJoCo scene for each grasp of a file, or print a single one."""
    saved = read_grasps(command.grasps)
    chosen = saved.grasps
    if command.grasp is not None:
        chosen = (grasp_with_id(command.grasps, saved, command.grasp),)
    if command.out is None and len(chosen) > 1:
        raise InputError(
            "several scenes cannot be printed: give a folder with --out DIR, or one grasp with "
            "--grasp ID"
        )
    friction = saved.friction if command.friction is None else command.friction
    fingers = with_planned_radius(finger_settings(command.fingers), saved.finger)
    written: list[str] = []
    with alone_in(command.out):
        for grasp in chosen:
            scene = build_scene(
                saved.body, grasp, friction, fingers=fingers, surface=command.surface
            )
            if command.out is not None:
                written.append(str(write_text(command.out / f"{grasp.id}.xml", scene.xml)))
                reporter.say(f"wrote {written[-1]}")
            elif reporter.json_only:
                reporter.document({"id": grasp.id, "xml": scene.xml})
            else:
                print(scene.xml, end="")  # noqa: T201 - the document itself
    if command.out is not None:
        reporter.document({"scenes": written})
    return Exit.GOOD
