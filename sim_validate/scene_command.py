"""The command that writes grasps as scenes."""

from grasp_core.errors import InputError
from scenes.mjcf import build_scene
from sim_validate import cli
from sim_validate.console import Reporter
from sim_validate.files import write_text
from sim_validate.grasps_file import read_grasps
from sim_validate.validate_command import finger_settings, planned_fingers


def write_scenes(command: cli.Scene, reporter: Reporter) -> int:
    """Write the scenes of a file's grasps, or print a single one."""
    saved = read_grasps(command.grasps)
    chosen = [grasp for grasp in saved.grasps if command.grasp in (None, grasp.id)]
    if not chosen:
        ids = ", ".join(grasp.id for grasp in saved.grasps[:5])
        raise InputError(f"{command.grasps}: no grasp {command.grasp!r}; there is {ids or 'none'}")
    if command.out is None and len(chosen) > 1:
        raise InputError("several scenes need --out DIR; or choose one with --grasp ID")
    friction = saved.friction if command.friction is None else command.friction
    fingers = finger_settings(planned_fingers(command.fingers, saved.finger))
    written: list[str] = []
    for grasp in chosen:
        scene = build_scene(saved.body, grasp, friction, fingers=fingers, surface=command.surface)
        if command.out is not None:
            written.append(str(write_text(command.out / f"{grasp.id}.xml", scene.xml)))
            reporter.say(f"wrote {written[-1]}")
        elif reporter.json_only:
            reporter.document({"id": grasp.id, "xml": scene.xml})
        else:
            print(scene.xml, end="")  # noqa: T201 - the document itself
    if command.out is not None:
        reporter.document({"scenes": written})
    return cli.Exit.GOOD
