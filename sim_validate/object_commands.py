"""The commands about objects: what one is as a polyhedron, and which are built in."""

import math
from dataclasses import asdict
from typing import Any, cast

from grasp_core.candidates import LEAST_SPAN_ANGLE
from grasp_core.planar_faces import MAX_FACES
from grasp_core.spanning import count_spanning
from scenes.objects import example_names
from sim_validate import cli
from sim_validate.console import Reporter
from sim_validate.plan_command import load_object


def inspect_object(command: cli.Inspect, reporter: Reporter) -> int:
    """Show the facts about a mesh."""
    body = load_object(command.object, command.mesh)
    spanning = (
        count_spanning(body.normals, LEAST_SPAN_ANGLE) if len(body.faces) <= MAX_FACES else None
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


def list_objects(_: cli.Objects, reporter: Reporter) -> int:
    """Name the built-in objects."""
    names = example_names()
    reporter.document({"objects": list(names)})
    if not reporter.json_only:
        for name in names:
            reporter.say(name)
    return cli.Exit.GOOD
