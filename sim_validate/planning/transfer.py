"""Runs the command `transfer`, which carries grasps over to a part that has changed."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Self

from grasp_core.allowed_values import FLAT
from grasp_core.by_value import counted
from grasp_core.declared import declared
from grasp_core.errors import InputError
from grasp_core.files.file_kinds import GRASPS, TRANSFER
from grasp_core.files.text_files import write_text
from grasp_core.mesh_files.limits import MeshChoices
from grasp_core.messages import MILLI
from grasp_core.objects.on_faces import check_planar
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.planning.grasps_json import plan_to_json
from grasp_core.planning.result import Outcomes, Plan, PlanCounts
from grasp_core.settings import extended
from grasp_core.transferring.transfer import (
    CHANGES,
    SURE_GROWTH,
    CarriedGrasp,
    Change,
    GraspFigures,
    Transfer,
    as_read,
    growth,
    transfer,
)
from sim_validate.commands import flags
from sim_validate.commands.console import TABLE_ROWS, Reporter, say_cut
from sim_validate.commands.exit_codes import Exit
from sim_validate.files.output_folders import alone_in
from sim_validate.files.result_files import AboutObject, ResultFile
from sim_validate.files.results_folder import remove_results
from sim_validate.planning.asked_objects import asked_grasps, load_object

NO_FIGURE = "-"
COLUMNS = ("grasp", "status", "mm", "deg", "mu*", "now", "quality N", "now", "faces")
"""How far contacts moved and turned, what they reach, and faces under them that changed."""
BAD_CHANGES: tuple[Change, ...] = ("worse", "gone")
"""What becomes of a grasp if its part should not have changed like that."""


@declared
class TransferFile(ResultFile):
    """Grasps carried over to a changed part; both parts are only named, so nothing reads it."""

    FILE = TRANSFER
    SCHEMA = 2

    old: AboutObject
    new: AboutObject
    transfer: Annotated[Transfer, FLAT]

    @classmethod
    def of(cls, found: Transfer) -> Self:
        """Record what became of grasps and faces."""
        return cls(AboutObject.of(found.old), AboutObject.of(found.new), found)


def transfer_file(command: flags.TransferFlags, reporter: Reporter) -> int:
    """Carry the grasps of a file over to a changed part, write them, and say what has changed."""
    saved = asked_grasps(command.grasps, reporter, friction=command.friction)
    if saved is None:
        return Exit.NONE
    check_planar(saved.body, "the old part")
    kept = None if command.out is None else command.out / GRASPS
    # from which grasps can be carried again
    if kept is not None and kept.exists() and kept.samefile(command.grasps):
        raise InputError(
            f"{command.out}: the grasps of the old part are in this folder and would be "
            "overwritten; give another --out"
        )
    new = _changed_part(command, saved.body)
    if not 1.0 / SURE_GROWTH <= (times := growth(saved.body, new)) <= SURE_GROWTH:
        reporter.warn(
            f"{command.part}: the changed part is {times:.4g} times as large as the old one; if "
            "that is not so, say its unit with --unit, or its scale with --scale"
        )
    with alone_in(command.out), reporter.progress("carrying over"):
        found = transfer(
            saved.body, new, saved.grasps, saved.friction, distance=command.carrying.distance_m,
            angle_deg=command.carrying.angle_deg, finger=saved.finger,
        )  # fmt: skip
        record = TransferFile.of(found)
        if command.out is not None:
            remove_results(command.out)
            grasps = write_text(command.out / GRASPS, carried_to_json(found, saved))
            path = write_text(command.out / TransferFile.FILE, record.text())
            reporter.say(f"wrote {grasps} and {path}")
    reporter.document(record.document())
    _show(found, reporter)
    if not found.carried:
        return Exit.NONE
    return Exit.NEGATIVE if any(map(found.count, BAD_CHANGES)) else Exit.GOOD


def carried_to_json(found: Transfer, saved: Plan) -> str:
    """Write the carried grasps as the text of a `grasps.json` of the changed part."""
    absence = None
    if not found.carried:
        absence = (
            f"none of the {len(found.grasps)} grasps could be carried over to the changed part"
        )
    nothing_tried = PlanCounts(faces=len(found.new.faces), quadruples=0, spanning=None)
    plan = Plan(
        body=found.new,
        grasps=found.carried,
        friction=found.friction,
        theta=math.atan(found.friction),
        seed=saved.seed,
        counts=nothing_tried,
        outcomes=Outcomes(0, 0, 0),
        absence=absence,
        finger=saved.finger,
    )
    return plan_to_json(found.new, plan)


def _changed_part(command: flags.TransferFlags, old: Polyhedron) -> Polyhedron:
    center, part = command.center_of_mass_m, Path(command.part)
    choices = extended(MeshChoices, command.limits)
    if part.suffix or part.is_file():  # a built-in object is as it is
        same = as_read(old)
        if center is None and (kept := same.pop("center_of_mass")) is not None:
            center = tuple(kept.tolist())
        choices = replace(choices, faces=same["faces"], largest_part=same["largest_part"])
    mesh = flags.MeshFlags(command.lengths, choices, center_of_mass_m=center)
    return load_object(command.part, mesh)


def _show(found: Transfer, reporter: Reporter) -> None:
    order = sorted(found.grasps, key=lambda each: -CHANGES.index(each.status))
    shown = order[:TABLE_ROWS]
    title = f"{counted(len(order), 'grasp')} of {found.old.name} on {found.new.name}"
    changed = {each.old for each in found.faces if each.moved or each.reshaped}
    reporter.table(title, COLUMNS, [_row(each, changed) for each in shown])
    say_cut(len(order), reporter)
    reporter.say(f"{found.new.name}: {found.faces_in_words}")
    counts = ", ".join(f"{found.count(status)} {status}" for status in CHANGES)
    reporter.say(
        f"{len(found.carried)} of {len(found.grasps)} grasps were carried over, with contacts "
        f"that may move by {MILLI * found.distance:.4g} mm: {counts}"
    )
    for each in shown:
        if each.status in BAD_CHANGES:
            reporter.warn(f"{each.old.id}: {each.status}: {each.reason}")
    if not found.carried:
        reporter.warn("no grasp is left; plan on the changed part anew")


def _row(each: CarriedGrasp, changed: set[int]) -> tuple[str, ...]:
    moved = turned = NO_FIGURE
    if all(contact.contact is not None for contact in each.contacts):
        moved = f"{MILLI * max(contact.distance for contact in each.contacts):.2f}"
        turned = f"{math.degrees(max(contact.turn for contact in each.contacts)):.2f}"
    old, new = _figures(each.before), _figures(each.after)
    faces = ", ".join(map(str, sorted(changed & {*each.old.faces}))) or NO_FIGURE
    return (each.old.id, each.status, moved, turned, old[0], new[0], old[1], new[1], faces)


def _figures(figures: GraspFigures | None) -> tuple[str, str]:
    if figures is None:
        return NO_FIGURE, NO_FIGURE
    return f"{figures.critical_friction:.4f}", f"{figures.ferrari_canny[0]:.4f}"
