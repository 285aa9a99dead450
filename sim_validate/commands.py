"""What each command does, from its flags to files, tables and an exit code."""

import math
import re
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any, cast

from grasp_core.candidates import LEAST_SPAN_ANGLE
from grasp_core.closure import force_closure
from grasp_core.concurrent_grasps import PYRAMID_SIDES
from grasp_core.critical import critical_friction
from grasp_core.errors import InputError
from grasp_core.planar_faces import MAX_FACES
from grasp_core.planner import plan
from grasp_core.records import SavedGrasps, grasps_from_json, plan_to_json
from grasp_core.spanning import spanning_quadruples
from grasp_core.versions import versions
from scenes.mjcf import build_scene
from scenes.objects import example_names, example_object
from sim_validate import cli
from sim_validate.analyze_command import analyze_file
from sim_validate.console import Reporter
from sim_validate.files import read_text, remove_results, write_text
from sim_validate.gate import measured_gate, require_faithful
from sim_validate.improving import show_gains
from sim_validate.plan_command import (
    asked_finger,
    load_object,
    plan_file,
    plan_object,
    say_counts,
)
from sim_validate.setup import Setup
from sim_validate.validate_command import (
    finger_settings,
    planned_fingers,
    prepared,
    simulate_grasps,
    validate_file,
    with_planned_fingers,
)
from sim_validate.validation import validate

RESULTS = Path("graspproof-out")
"""Where `run` writes, a folder for each object, if not told otherwise."""


def execute(command: cli.Command) -> int:
    """Carry out a command and return its exit code."""
    speech = command.speech
    reporter = Reporter(speech.quiet, speech.verbose, speech.json)
    return ACTIONS[type(command)](command, reporter)


def _run(command: cli.Run, reporter: Reporter) -> int:
    planning = command.planning
    testing = with_planned_fingers(command.testing, asked_finger(planning))
    setup, _ = prepared(testing, planning.seed, command.out or RESULTS)
    body, found, moves = plan_object(command.object, planning, testing.jobs, reporter)
    folder = command.out or RESULTS / _folder_name(body.name)
    require_faithful(setup, found.friction, body.radius)
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
        scene = setup.scene(body, grasp, found.friction)
        write_text(folder / "scenes" / f"{grasp.id}.xml", scene.xml)
    saved = SavedGrasps(body, found.friction, found.seed, found.grasps, found.finger)
    code = simulate_grasps(saved, testing, folder, reporter)
    reporter.say(f"results in {folder}/: grasps.json, verdicts.json, scenes/")
    return code


def _folder_name(name: str) -> str:
    """A file name that is one plain part of a path."""
    return re.sub(r"[^\w-]+", "_", name) or "object"


def _scene(command: cli.Scene, reporter: Reporter) -> int:
    saved = grasps_from_json(read_text(command.grasps))
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


def _inspect(command: cli.Inspect, reporter: Reporter) -> int:
    body = load_object(command.object, command.mesh)
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
        "patches": None if body.patches is None else asdict(body.patches),
        "largest_spread_deg": math.degrees(max((face.spread for face in body.faces), default=0.0)),
        "largest_depth_m": max((face.depth for face in body.faces), default=0.0),
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
    return "-" if value is None else str(value)


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
    gate = measured_gate(Setup())
    verdict = validate(body, grasp) if gate.passed else None
    cone = math.tan(grasp.force_cones[0].half_angle) * math.cos(math.pi / PYRAMID_SIDES)
    checks = {
        "linear programs": math.isclose(3.0 * grasp.radius / body.radius, cone, rel_tol=1e-6),
        "conic programs": force_closure(grasp).verify(),
        "critical friction": critical_friction(grasp) == 0.0,
        **{f"gate: {check.name}": check.passed for check in gate.checks},
        "simulated grasp holds": verdict is not None and verdict.held,
        "simulated controls do not": (
            verdict is not None and verdict.controls_failed and bool(verdict.controls)
        ),
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
    cli.Validate: validate_file,
    cli.Scene: _scene,
    cli.Analyze: analyze_file,
    cli.Inspect: _inspect,
    cli.Objects: _objects,
    cli.Doctor: _doctor,
}
