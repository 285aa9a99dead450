"""What each command does, from its flags to files, tables and an exit code."""

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

from grasp_core.closure import force_closure
from grasp_core.concurrent_grasps import PYRAMID_SIDES
from grasp_core.critical import critical_friction
from grasp_core.errors import InputError
from grasp_core.planner import MAX_FACES, plan
from grasp_core.ranking import LEAST_SPAN_ANGLE
from grasp_core.records import SavedGrasps, grasps_from_json, plan_to_json
from grasp_core.spanning import spanning_quadruples
from grasp_core.values import Grasp, Polyhedron
from grasp_core.versions import versions
from scenes.mjcf import build_scene
from scenes.objects import example_names, example_object
from sim_validate import cli
from sim_validate.analyze_command import analyze_file
from sim_validate.console import TABLE_ROWS, Reporter
from sim_validate.engines import each
from sim_validate.files import read_text, remove_results, write_text
from sim_validate.improving import show_gains
from sim_validate.plan_command import (
    load_object,
    plan_file,
    plan_object,
    say_counts,
    say_cut,
)
from sim_validate.validation import Verdict, validate
from sim_validate.verdict_records import summary, verdicts_to_json


def execute(command: cli.Command) -> int:
    """Carry out a command and return its exit code."""
    speech = command.speech
    reporter = Reporter(speech.quiet, speech.verbose, speech.json)
    return ACTIONS[type(command)](command, reporter)


def _run(command: cli.Run, reporter: Reporter) -> int:
    jobs = command.testing.jobs
    body, found, moves = plan_object(command.object, command.planning, jobs, reporter)
    folder = command.out or Path("graspproof-out") / _folder_name(body.name)
    remove_results(folder)
    write_text(folder / "grasps.json", plan_to_json(body, found, moves))
    say_counts(body, found, reporter)
    if found.absence:
        reporter.say(found.absence)
        reporter.document({"absence": found.absence, "out": str(folder)})
        return cli.Exit.NONE
    if moves:
        show_gains(moves, reporter)
    for grasp in found.grasps:
        scene = build_scene(
            body, grasp, found.friction, max_normal_force=command.testing.max_normal_force
        )
        write_text(folder / "scenes" / f"{grasp.id}.xml", scene.xml)
    saved = SavedGrasps(body, found.friction, found.seed, found.grasps)
    code = _test(saved, command.testing, folder, reporter)
    reporter.say(f"results in {folder}/: grasps.json, verdicts.json, scenes/")
    return code


def _folder_name(name: str) -> str:
    """A file name that is one plain part of a path."""
    return re.sub(r"[^\w-]+", "_", name) or "object"


def _validate(command: cli.Validate, reporter: Reporter) -> int:
    saved = grasps_from_json(read_text(command.grasps))
    if not saved.grasps:
        absence = f"{command.grasps} holds no grasp"
        reporter.say(absence)
        reporter.document({"absence": absence})
        return cli.Exit.NONE
    chosen = SavedGrasps(
        saved.body,
        saved.friction if command.friction is None else command.friction,
        saved.seed if command.seed is None else command.seed,
        saved.grasps[: command.limit],
    )
    return _test(chosen, command.testing, command.out, reporter)


@dataclass(frozen=True, slots=True)
class _Trial:
    """One grasp to validate, as it travels to a worker."""

    body: Polyhedron
    grasp: Grasp
    friction: float
    max_normal_force: float
    seed: int


def _try(trial: _Trial) -> Verdict:
    return validate(
        trial.body, trial.grasp, trial.friction,
        max_normal_force=trial.max_normal_force, seed=trial.seed,
    )  # fmt: skip


def _test(saved: SavedGrasps, testing: cli.Testing, folder: Path | None, reporter: Reporter) -> int:
    """Validate grasps, write what is done even when interrupted, and show the verdicts."""
    trials = [
        _Trial(saved.body, grasp, saved.friction, testing.max_normal_force, saved.seed)
        for grasp in saved.grasps
    ]
    verdicts: list[Verdict] = []
    try:
        with reporter.progress("simulating") as steps:
            for verdict in each(_try, trials, jobs=testing.jobs):
                verdicts.append(verdict)
                held = sum(verdict.held for verdict in verdicts)
                steps.update(len(verdicts), len(trials), f"({held} held)")
    finally:
        complete = len(verdicts) == len(trials)
        text = verdicts_to_json(saved.body, saved.friction, verdicts, complete=complete)
        if folder and verdicts:
            write_text(folder / "verdicts.json", text)
    if reporter.json_only:
        print(text, end="")  # noqa: T201 - the document itself
    _show(saved.grasps, verdicts, reporter)
    good = all(verdict.held and verdict.controls_failed for verdict in verdicts)
    return cli.Exit.GOOD if good else cli.Exit.NEGATIVE


def _show(grasps: Sequence[Grasp], verdicts: Sequence[Verdict], reporter: Reporter) -> None:
    rows: list[tuple[str, ...]] = []
    for grasp, verdict in zip(grasps[:TABLE_ROWS], verdicts, strict=False):
        worst = max(trial.hold.displacement_m for trial in verdict.wrenches)
        held = sum(control.held for control in verdict.controls)
        rows.append(
            (grasp.id, grasp.family, f"{1e3 * grasp.radius:.3g}",
             f"{verdict.critical_friction.predicted:.4f}", verdict.outcome.value,
             f"{1e6 * worst:.2g}", f"{held}/{len(verdict.controls)} held")
        )  # fmt: skip
    columns = ("grasp", "family", "radius mm", "mu*", "simulated", "moved um", "controls")
    reporter.table("verdicts", columns, rows)
    say_cut(len(verdicts), reporter)
    totals = summary(verdicts)
    reporter.say(
        f"{totals['grasps_held']} of {totals['grasps']} grasps held all wrenches; "
        f"{totals['controls_held']} of {totals['controls']} negative controls held (none should)"
    )
    if not totals["controls"]:
        reporter.warn("there were no negative controls: nothing shows that this test can fail")


def _scene(command: cli.Scene, reporter: Reporter) -> int:
    saved = grasps_from_json(read_text(command.grasps))
    chosen = [grasp for grasp in saved.grasps if command.grasp in (None, grasp.id)]
    if not chosen:
        ids = ", ".join(grasp.id for grasp in saved.grasps[:5])
        raise InputError(f"{command.grasps}: no grasp {command.grasp!r}; there is {ids or 'none'}")
    if command.out is None and len(chosen) > 1:
        raise InputError("several scenes need --out DIR; or choose one with --grasp ID")
    friction = saved.friction if command.friction is None else command.friction
    written: list[str] = []
    for grasp in chosen:
        scene = build_scene(saved.body, grasp, friction, max_normal_force=command.max_normal_force)
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


def _inspect(command: cli.Inspect, reporter: Reporter) -> int:
    body = load_object(command.object, command.unit)
    spanning = (
        len(spanning_quadruples(body.normals, LEAST_SPAN_ANGLE).indices)
        if len(body.faces) <= MAX_FACES
        else None
    )
    facts = {
        "name": body.name,
        "vertices": len(body.vertices),
        "triangles": len(body.triangles),
        "faces": len(body.faces),
        "faces_with_holes": sum(bool(face.holes) for face in body.faces),
        "non_convex_faces": sum(len(face.pieces) > 1 for face in body.faces),
        "volume_m3": body.volume,
        "radius_m": body.radius,
        "center_of_mass_m": body.center_of_mass.tolist(),
        "spanning_quadruples": spanning,
        "content_sha256": body.content_sha256,
        "notes": list(body.notes),
    }
    reporter.document(facts)
    reporter.table(body.name, ("property", "value"), [(k, _short(v)) for k, v in facts.items()])
    return cli.Exit.GOOD


def _short(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, list):
        return ", ".join(_short(item) for item in cast("list[Any]", value)) or "-"
    return "not counted" if value is None else str(value)


def _objects(_: cli.Objects, reporter: Reporter) -> int:
    names = example_names()
    reporter.document({"objects": list(names)})
    if not reporter.json_only:
        for name in names:
            reporter.say(name)
    return cli.Exit.GOOD


def _doctor(_: cli.Doctor, reporter: Reporter) -> int:
    """Plan and validate the tetrahedron, whose answers are known in closed form."""
    body = example_object("tetrahedron")
    grasp = plan(body).grasps[0]
    verdict = validate(body, grasp)
    cone = math.tan(grasp.force_cones[0].half_angle) * math.cos(math.pi / PYRAMID_SIDES)
    checks = {
        "linear programs": math.isclose(3.0 * grasp.radius / body.radius, cone, rel_tol=1e-6),
        "conic programs": force_closure(grasp).verify(),
        "critical friction": critical_friction(grasp) == 0.0,
        "simulated grasp holds": verdict.held,
        "simulated controls do not": verdict.controls_failed and bool(verdict.controls),
    }
    found = versions()
    reporter.document({"versions": found, "checks": checks})
    rows = [(name, value) for name, value in found.items()]
    rows += [(name, "ok" if passed else "FAILED") for name, passed in checks.items()]
    reporter.table("graspproof doctor", ("what", "state"), rows)
    return cli.Exit.GOOD if all(checks.values()) else cli.Exit.INTERNAL


ACTIONS: dict[type[Any], Callable[[Any, Reporter], int]] = {
    cli.Run: _run,
    cli.Plan: plan_file,
    cli.Validate: _validate,
    cli.Scene: _scene,
    cli.Analyze: analyze_file,
    cli.Inspect: _inspect,
    cli.Objects: _objects,
    cli.Doctor: _doctor,
}
