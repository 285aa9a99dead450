"""Runs the commands `inspect` and `objects`, which show an object or list the built-in ones."""

import math
from collections.abc import Iterator
from dataclasses import asdict

from grasp_core.cones.spanning import count_spanning
from grasp_core.objects.planar_faces import MAX_FACES
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.planning.planned_cones import LEAST_SPAN_ANGLE
from grasp_core.short_text import vector
from scenes.example_objects import example_names
from sim_validate.cli import command_flags
from sim_validate.cli.console import Reporter
from sim_validate.cli.exit_codes import Exit
from sim_validate.commands.asked.objects import load_object

WIDTH = 20
"""Width of the column with the names of facts, in characters."""


def inspect_object(command: command_flags.Inspect, reporter: Reporter) -> int:
    """Show the facts about a mesh, such as its faces and mass properties."""
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
    reporter.say(body.name)
    for what, said in _in_words(body, spanning):
        reporter.say(f"  {what:{WIDTH}} {said}")
    return Exit.GOOD


def _in_words(body: Polyhedron, spanning: int | None) -> Iterator[tuple[str, str]]:
    """Yield the name and value of each fact about a mesh, in words for people."""
    yield "mesh", f"{len(body.vertices)} vertices, {len(body.triangles)} triangles"
    if body.patches is None:
        holed = sum(bool(face.holes) for face in body.faces)
        dented = sum(len(face.pieces) > 1 for face in body.faces)
        yield "faces", f"{len(body.faces)} planar, {dented} not convex, {holed} with holes"
    else:
        spread = math.degrees(max((face.spread for face in body.faces), default=0.0))
        depth = max((face.depth for face in body.faces), default=0.0)
        asked = body.patches
        yield "faces", f"{len(body.faces)} nearly flat patches of a curved surface"
        yield "their spread", f"{spread:.4g} deg at most, {asked.spread_deg:.4g} deg allowed"
        yield (
            "their depth",
            (f"{depth:.4g} m at most, {asked.depth:.4g} of the object's largest extent allowed"),
        )
    yield "volume", f"{body.volume:.6g} m^3"
    yield "centre of mass", f"{vector(body.center_of_mass)} m"
    yield "radius about it", f"{body.radius:.6g} m"
    if spanning is not None:
        yield "spanning quadruples", f"{spanning} sets of four faces whose normals positively span"
    yield "sha256 of content", body.content_sha256
    for note in body.notes:
        yield "note", note


def list_objects(_: command_flags.Objects, reporter: Reporter) -> int:
    """List the names of the built-in objects."""
    names = example_names()
    reporter.document({"objects": list(names)})
    if not reporter.json_only:
        for name in names:
            reporter.say(name)
    return Exit.GOOD
