"""Runs the commands `inspect` and `objects`, which show an object or list the built-in ones."""

import math
from collections.abc import Iterator
from dataclasses import asdict
from typing import Annotated, Any

import numpy as np

from grasp_core.arrays import Point, UnitVector
from grasp_core.by_value import vector
from grasp_core.cones.spanning import count_spanning
from grasp_core.declared import Declared, declared
from grasp_core.figures import Shown
from grasp_core.files.records import record_of
from grasp_core.messages import MILLI
from grasp_core.objects.planar_faces import MAX_FACES
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.objects.surface import Face
from grasp_core.planning.quadruples import LEAST_SPAN_ANGLE
from scenes.drawing.pictures import MOST_NUMBERED, write_object_picture
from scenes.example_objects import example_names
from sim_validate.commands import flags
from sim_validate.commands.console import Reporter
from sim_validate.commands.exit_codes import Exit
from sim_validate.planning.asked_objects import load_object

CM3 = 1e6
MM2 = 1e6
ALONG = 1e-4
"""Largest angle from an axis at which a face counts as facing along it [rad]."""
NOTHING_MM = 1e-6
"""Coordinate that is written as zero [mm]."""


@declared
class ListedFace(Declared):
    """A face in a list."""

    number: Annotated[int, Shown("face")]
    place: Annotated[str, Shown("where it is")]
    area_m2: Annotated[float, Shown("area mm^2", ".5g", MM2)]
    normal: UnitVector
    """Into the object."""
    center_m: Point


def inspect_object(command: flags.Inspect, reporter: Reporter) -> int:
    """Show the facts about a mesh, such as its faces and mass properties."""
    body = load_object(command.object, command.mesh)
    spanning = (
        count_spanning(body.normals, LEAST_SPAN_ANGLE) if len(body.faces) <= MAX_FACES else None
    )
    faces = [
        ListedFace(number, _place(face), face.area, face.normal, face.centroid)
        for number, face in enumerate(body.faces)
    ]
    facts: dict[str, Any] = {
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
        "surface": record_of(body.surface) | {"volume_source": body.surface.volume_source},
        "radius_m": body.radius,
        "center_of_mass_m": body.center_of_mass.tolist(),
        "spanning_quadruples": spanning,
        "face_list": list(map(record_of, faces)),
        "content_sha256": body.content_sha256,
        "notes": list(body.notes),
    }
    if command.picture is not None:
        facts["picture"] = str(write_object_picture(body, command.picture))
    reporter.document(facts)
    reporter.say(body.name)
    for sentence in _sentences(body, facts):
        reporter.say(f"  {sentence}")
    if body.patches is None and len(body.faces) <= MOST_NUMBERED:
        reporter.records("faces, by the numbers in ids of grasps", faces)
    if command.picture is not None:
        reporter.say(f"wrote {command.picture}")
    else:
        reporter.say("  `--picture FILE.png` draws it.")
    return Exit.GOOD


def _sentences(body: Polyhedron, facts: dict[str, Any]) -> Iterator[str]:
    yield f"The mesh has {len(body.vertices)} vertices and {len(body.triangles)} triangles."
    yield _on_faces(body, facts)
    yield (
        f"{'It' if body.surface.closed else 'Its convex hull'} encloses a volume of "
        f"{CM3 * body.volume:.4g} cm^3, and it reaches "
        f"{MILLI * body.radius:.4g} mm from its centre of mass, which is at "
        f"{vector(np.round(MILLI * body.center_of_mass, 3))} mm."
    )
    if (spanning := facts["spanning_quadruples"]) is not None:
        yield (
            f"The normals of {spanning} sets of four faces positively span all directions, so the "
            "constructions of the paper have faces to start from." if spanning else
            "No four of its faces have normals that positively span all directions, as in boxes "
            "and prisms. Grasps are planned all the same, with force cones that lean and need "
            "friction; only `--cones normal` would find none."
        )  # fmt: skip
    yield from (f"Note: {note}." for note in body.notes)
    yield f"The sha256 of its content is {body.content_sha256}."


def _on_faces(body: Polyhedron, facts: dict[str, Any]) -> str:
    if body.patches is None:
        return (
            f"Its {len(body.faces)} faces are planar; {facts['non_convex_faces']} of them "
            f"are not convex, and {facts['faces_with_holes']} have holes."
        )
    asked = body.patches
    return (
        f"Its surface is curved: fingers may stand on {len(body.faces)} nearly flat patches, which "
        f"turn by {facts['largest_spread_deg']:.2g} deg at most ({asked.spread_deg:.4g} deg "
        f"allowed) and are {MILLI * facts['largest_depth_m']:.2g} mm deep at most "
        f"({asked.depth:.4g} of its extent allowed)."
    )


def list_objects(_: flags.Objects, reporter: Reporter) -> int:
    """List the names of the built-in objects."""
    names = example_names()
    reporter.document({"objects": list(names)})
    if not reporter.json_only:
        for name in names:
            reporter.say(name)
    return Exit.GOOD


def _place(face: Face) -> str:
    """Say where a face is and what it faces, outwards, such as `facing +x at x = 60 mm`."""
    outward = (-face.normal).tolist()
    axis = max(range(3), key=lambda index: abs(outward[index]))
    across = math.hypot(*(each for index, each in enumerate(outward) if index != axis))
    center = [f"{0.0 if abs(MILLI * each) < NOTHING_MM else MILLI * each:.5g}"
              for each in face.centroid.tolist()]  # fmt: skip
    if across <= ALONG:
        name, sign = "xyz"[axis], "+" if outward[axis] > 0.0 else "-"
        return f"facing {sign}{name} at {name} = {center[axis]} mm"
    side = ", ".join(f"{round(each, 2) + 0.0:g}" for each in outward)
    return f"facing ({side}) around ({', '.join(center)}) mm"
