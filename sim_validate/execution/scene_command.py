"""Runs the commands that write grasps for other programs: `scene` for MuJoCo, `export` for others.

Scenes have true masses if the flags ask for them.
"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from grasp_core.declared import counted
from grasp_core.errors import InputError, NoForcesError
from grasp_core.files.text_files import write_text
from grasp_core.planning.result import Plan
from grasp_core.records.grasps_json import load_grasps
from grasp_core.settings import extended
from grasp_core.values import Grasp
from scenes import exports
from scenes.settings import ScaledScene
from sim_validate.engine.setup import Setup, with_planned_radius
from sim_validate.execution.asked_executions import holding
from sim_validate.execution.execute import chosen_squeeze, held_scene
from sim_validate.kit import command_flags
from sim_validate.kit.console import Reporter
from sim_validate.kit.exit_codes import Exit, FlagsError
from sim_validate.kit.result_folders import alone_in
from sim_validate.planning.grasps_json import grasp_with_id, read_grasps
from sim_validate.settings.executions import ExecutionSettings, Holding

TextOf = Callable[[Grasp], str]


def write_scenes(command: command_flags.Scene, reporter: Reporter) -> int:
    """Write a MuJoCo scene for each grasp of a file, or print a single one."""
    _check(command)
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
    if command.holding.weighed:
        text_of = _held(command, saved, friction, reporter)
    else:
        text_of = _scaled(command, saved, friction)
    with alone_in(command.out):
        written = [_written(grasp, text_of, command.out, reporter) for grasp in chosen]
    if command.out is not None:
        reporter.document({"scenes": [path for path in written if path]})
    return Exit.GOOD if all(written) else Exit.NEGATIVE


def _written(grasp: Grasp, text_of: TextOf, folder: Path | None, reporter: Reporter) -> str:
    """Write or print the scene of one grasp; return its place, or nothing if it has no scene."""
    try:
        text = text_of(grasp)
    except NoForcesError as error:
        reporter.warn(f"{grasp.id}: no scene: {error}")
        if folder is None:
            reporter.document({"id": grasp.id, "absence": str(error)})
        return ""
    if folder is None:
        reporter.document({"id": grasp.id, "xml": text})
        if not reporter.json_only:
            print(text, end="")  # noqa: T201 - the document itself
        return grasp.id
    path = str(write_text(folder / f"{grasp.id}.xml", text))
    reporter.say(f"wrote {path}")
    return path


def _check(command: command_flags.Scene) -> None:
    """Refuse flags that the scene asked for does not use, before any file is read."""
    if command.holding.weighed:
        if command.scaled != ScaledScene():
            raise FlagsError(
                "the flags from --max-normal-force-n to --surface are for scenes with scaled "
                "masses: leave out --mass-kg and --density-kg-m3, or use the flags from "
                "--tip-mass-kg to --tip-radius-m"
            )
    elif command.holding != Holding():
        raise FlagsError(
            "the flags from --tip-mass-kg to --tip-radius-m are for objects of true mass: give "
            "--mass-kg or --density-kg-m3 too"
        )


def _scaled(command: command_flags.Scene, saved: Plan, friction: float) -> TextOf:
    setup = extended(Setup, command.scaled)
    setup = replace(setup, fingers=with_planned_radius(setup.fingers, saved.finger))
    return lambda grasp: setup.scene(saved.body, grasp, friction).xml


def _held(command: command_flags.Scene, saved: Plan, friction: float, reporter: Reporter) -> TextOf:
    own = holding(command.holding, saved.body, saved.finger)
    settings = extended(ExecutionSettings, own)

    def text_of(grasp: Grasp) -> str:
        best = chosen_squeeze(saved.body, grasp, friction, settings)
        if best.scale < 1.0:
            reporter.warn(
                f"{grasp.id}: the squeeze is certified for {best.scale:.3g} of the weight only, so "
                "the object may slip; use a smaller mass, or a larger --push-n"
            )
        return held_scene(saved.body, best.grip, settings).xml

    return text_of


def export_grasps(command: command_flags.Export, reporter: Reporter) -> int:
    """Write the grasps of a file as one file of another program's format."""
    endings = exports.ENDINGS[command.to]
    if command.out.suffix.lower() not in endings:
        raise FlagsError(
            f"--out must end in {' or '.join(endings)} with --to {command.to}, got {command.out}"
        )
    plan = load_grasps(command.grasps)
    if command.grasp is not None:
        plan = replace(plan, grasps=(grasp_with_id(command.grasps, plan, command.grasp),))
    if not plan.grasps:
        reporter.say(f"{command.grasps} holds no grasp")
        reporter.document({"absence": f"{command.grasps} holds no grasp"})
        return Exit.NONE
    chosen = plan[: command.limit]
    radius = command.fingertip_radius_m
    exports.export_grasps(chosen, command.out, command.to, fingertip_radius_m=radius)
    reporter.say(f"wrote {command.out} with {counted(len(chosen), 'grasp')}")
    ids = [grasp.id for grasp in chosen]
    reporter.document({"to": command.to, "out": str(command.out), "grasps": ids})
    return Exit.GOOD
