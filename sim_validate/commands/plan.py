"""The command that plans: from an object to certified grasps, a file and tables."""

import math
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from grasp_core.errors import InputError
from grasp_core.mesh_files.limits import MeshLimits
from grasp_core.mesh_files.reading import FORMATS
from grasp_core.objects.build import load_polyhedron
from grasp_core.planning.planner import plan
from grasp_core.planning.reach import Finger
from grasp_core.planning.request import methods_for
from grasp_core.planning.result import Plan
from grasp_core.records.grasps_json import Moved, plan_to_json
from grasp_core.values import FaceQuadruple, Grasp, PatchLimits, Polyhedron
from scenes.example_objects import example_object
from sim_validate.cli import command_flags, flag_groups
from sim_validate.cli.console import TABLE_ROWS, Reporter
from sim_validate.cli.exit_codes import Exit
from sim_validate.files.folder_lock import alone_in
from sim_validate.files.reading import write_text
from sim_validate.files.stale_results import remove_results
from sim_validate.parallel.certifying import Asked, Found, certified, wider
from sim_validate.parallel.improving import improved, show_gains
from sim_validate.records.regions import write_regions


def load_object(name: str, mesh: flag_groups.Mesh) -> Polyhedron:
    """A mesh file, or a built-in object when the name has no mesh ending."""
    path = Path(name)
    if path.suffix.lower().lstrip(".") in FORMATS or path.is_file():
        given = mesh.limits
        return load_polyhedron(
            path,
            unit=mesh.unit,
            faces=mesh.faces,
            patches=PatchLimits(mesh.patch_spread_deg, mesh.patch_depth, mesh.patches),
            center_of_mass=mesh.center_of_mass_m,
            limits=MeshLimits(
                max_bytes=given.max_mesh_bytes,
                max_triangles=given.max_triangles,
                max_faces=given.max_faces,
                max_parts=given.max_parts,
                max_seconds=given.max_mesh_seconds,
                max_memory_mib=given.max_mesh_memory_mib,
            ),
        )
    if path.suffix or len(path.parts) > 1:
        raise InputError(f"{name}: no such file, and the ending is none of {', '.join(FORMATS)}")
    if replace(mesh, limits=flag_groups.MeshLimits()) != flag_groups.Mesh():
        raise InputError(
            f"{name} is built in; --unit, --faces, --patches, --patch-spread-deg, --patch-depth "
            "and --center-of-mass-m say how mesh files are read"
        )
    return example_object(name)


def object_to_plan(name: str, planning: flag_groups.Planning, reporter: Reporter) -> Polyhedron:
    """The object, once all that is asked for fits it.

    Raises:
        InputError: The object or a setting is refused.
    """
    if planning.ceiling is not None and not planning.optimize:
        raise InputError("--ceiling bounds what --optimize may reach; give both or neither")
    _check_optimize(planning)
    if planning.regions and planning.share_faces_m is not None:
        raise InputError(
            "--regions would let fingers that share a face meet; leave it or --share-faces-m out"
        )
    body = load_object(name, planning.mesh)
    if planning.optimize and body.patches:
        raise InputError(
            f"{body.name} has a curved surface; --optimize is for exact planar faces only"
        )
    for note in body.notes:
        reporter.warn(f"{body.name}: {note}")
    reporter.detail(f"{body.name}: mesh {body.content_sha256}, {len(body.triangles)} triangles")
    return body


def plan_object(
    body: Polyhedron, planning: flag_groups.Planning, jobs: int, reporter: Reporter
) -> tuple[Plan, tuple[Moved, ...]]:
    """The grasps of an object, moved if that is asked for, and how they were moved.

    Raises:
        InputError: A setting is refused.
    """
    with reporter.progress("planning") as steps:
        found = plan(
            body,
            planning.friction,
            families=planning.family or methods_for(body),
            cones=planning.cones,
            theta_deg=planning.theta_deg,
            limit=planning.limit,
            rank_by=planning.rank_by,
            seed=planning.seed,
            cells=planning.cells,
            complete=planning.complete,
            finger=asked_finger(planning),
            clearance=planning.edge_clearance_m,
            share_faces=planning.share_faces_m,
            progress=lambda done, total, grasps: steps.update(done, total, f"({grasps} grasps)"),
        )
    moves: tuple[Moved, ...] = ()
    if planning.optimize and found.grasps:
        found, moves = improved(
            body, found, finger_radius=planning.finger_radius_m, parts=planning.ceiling, jobs=jobs,
            reporter=reporter,
        )  # fmt: skip
    return found, moves


def with_regions(
    body: Polyhedron, found: Plan, planning: flag_groups.Planning, folder: Path | None, jobs: int,
    reporter: Reporter,
) -> Plan:  # fmt: skip
    """The plan with certified regions, where that is asked for; proofs go to the folder."""
    if not (planning.regions and found.grasps):
        return found
    asked = Asked(found.friction, clearance=planning.edge_clearance_m)
    grasps = list[Grasp]()

    def kept() -> Iterator[Found]:
        for grasp, proved in certified(body, found.grasps, asked, jobs=jobs, reporter=reporter):
            grasps.append(wider(grasp, proved))
            yield grasp, proved

    write_regions(folder, body, asked, kept())
    widened = sum(new is not old for new, old in zip(grasps, found.grasps, strict=True))
    reporter.say(f"{widened} of {len(grasps)} grasps got regions with proofs of their own")
    return replace(found, grasps=tuple(grasps))


def _check_optimize(planning: flag_groups.Planning) -> None:
    kept = (planning.edge_clearance_m, planning.share_faces_m, planning.approach_m)
    if planning.optimize and any(kept):
        raise InputError(
            "--optimize moves contacts without regard to --edge-clearance-m, --share-faces-m and "
            "--approach-m; leave it out, or them"
        )


def asked_finger(planning: flag_groups.Planning) -> Finger | None:
    """The fingers whose free lines are to be planned, if any."""
    if planning.approach_m is None:
        if planning.finger_radius_m is not None and not planning.optimize:
            raise InputError(
                "--finger-radius-m also needs --approach-m, the length of the free line on which "
                "fingers come, or --optimize, which keeps contacts that far from edges"
            )
        return None
    if planning.finger_radius_m is None:
        raise InputError("--approach-m also needs --finger-radius-m, the radius of the fingertips")
    return Finger(planning.finger_radius_m, planning.approach_m)


def plan_file(command: command_flags.Plan, reporter: Reporter) -> int:
    """Plan, write the grasps, and show the best."""
    body = object_to_plan(command.object, command.planning, reporter)
    with alone_in(command.out):
        found, moves = plan_object(body, command.planning, command.jobs, reporter)
        if command.out:
            remove_results(command.out)
        found = with_regions(body, found, command.planning, command.out, command.jobs, reporter)
        text = plan_to_json(body, found, moves)
        if command.out:
            path = write_text(command.out / "grasps.json", text)
            reporter.say(f"wrote {path}")
    if reporter.json_only:
        print(text, end="")  # noqa: T201 - the document itself
    say_counts(body, found, reporter)
    if found.absence:
        reporter.say(found.absence)
        return Exit.NONE
    rows = [
        (g.id, g.family, f"{1e3 * g.radius:.3g}" if g.radius else "-", f"{g.critical_friction:.4f}",
         f"{math.degrees(g.span_angle):.2f}", f"{g.closure_margin:.4f}",
         f"{g.ferrari_canny[0]:.4f}")
        for g in found.grasps[:TABLE_ROWS]
    ]  # fmt: skip
    columns = ("grasp", "family", "radius mm", "mu*", "theta* deg", "margin", "quality N")
    reporter.table(f"{len(found.grasps)} grasps of {body.name}", columns, rows)
    say_cut(len(found.grasps), reporter)
    if moves:
        show_gains(moves, reporter)
    return Exit.GOOD


def say_counts(body: Polyhedron, found: Plan, reporter: Reporter) -> None:
    """What was tried, and how it ended."""
    counts = found.counts
    reporter.say(
        f"{body.name}: {counts.faces} faces, {counts.quadruples} face quadruples, "
        + (f"normals of {counts.spanning} span (P3), " if counts.spanning is not None else "")
        + f"friction {found.friction:g}, "
        f"theta {math.degrees(found.theta):.4g} deg"
    )
    known = found.outcomes
    reporter.say(
        f"face quadruples: {known.held} with a certified grasp, {known.absent} proved to have "
        f"none, {len(found.undecided)} undecided, {known.open - len(found.undecided)} left open"
        + (f", {known.out_of_reach} out of reach" if found.unreached else "")
    )
    for method, tally in counts.families.items():
        undecided = f"{tally.undecided} undecided, " if method == "free" else ""
        undecided += f"{tally.unreachable} out of reach, " if found.unreached else ""
        reporter.say(
            f"{method}: {tally.tried} tried, {tally.pruned} pruned, {tally.infeasible} "
            f"infeasible, {undecided}{tally.duplicates} duplicates, {tally.found} found, "
            f"{tally.rejected} rejected, {found.seconds[method]:.2f} s"
        )
    if found.undecided:
        named = [f"{_listed(faces)} ({100.0 * share:.3g} % open)"
                 for faces, share in found.undecided.items()]  # fmt: skip
        reporter.say(f"undecided faces: {', '.join(named[:TABLE_ROWS])}")
        say_cut(len(named), reporter)
    reasons = Counter(_whoever(why) for why in found.unreached.values())
    for why, count in reasons.most_common():
        reporter.say(f"out of reach: {why}, on {count} face quadruples")


def _whoever(why: str) -> str:
    """A reason without the numbers of the fingers."""
    why = re.sub(r"fingertips \d+ and \d+", "two fingertips", why)
    return re.sub(r"(finger(?:tip)?) \d+", r"a \1", why)


def _listed(faces: FaceQuadruple) -> str:
    return "-".join(str(face) for face in faces)


def say_cut(count: int, reporter: Reporter) -> None:
    """Say how many rows a table has not shown."""
    if count > TABLE_ROWS:
        reporter.say(f"... and {count - TABLE_ROWS} more")
