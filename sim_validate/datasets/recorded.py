"""Reads a contact set from a dataset, and how its trials ended, to be simulated again."""

from itertools import islice
from pathlib import Path

from grasp_core.errors import InputError
from grasp_core.planning.given_contacts import seat
from sim_validate.closure.replaying import Recorded, Wanted
from sim_validate.datasets.meshes import stored_body
from sim_validate.datasets.open_dataset import select
from sim_validate.datasets.rows import GIVEN, GraspRow, ObjectRow, TrialRow
from sim_validate.datasets.varied import VARIED
from sim_validate.engine.setup import Agenda, Setup
from sim_validate.planning.asked_objects import NAMED, some


def recorded_in_dataset(folder: Path, wanted: Wanted) -> Recorded:
    """Read a grasp or a negative control from the tables of a dataset."""
    chosen = select(folder)
    if wanted.grasp is None or wanted.trial is not None or wanted.grasps is not None:
        raise InputError(
            f"{folder} is a dataset: name a grasp with --grasp GRASP_ID, and give neither --trial "
            "nor --grasps"
        )
    name = wanted.grasp if wanted.control is None else f"{wanted.grasp}:{wanted.control}"
    row = next(chosen.rows(GraspRow, grasp_id=name), None)
    if row is None or not row.was_tried:
        there = some(row.grasp_id for row in islice(chosen.rows(GraspRow), NAMED))
        raise InputError(
            f"{folder}: no simulated grasp is named {name}; the dataset has {there}, ..."
        )
    config = chosen.config()
    objects = chosen.rows(ObjectRow, object_id=row.object_id)
    source = next((each.source_name for each in objects), row.object_id)
    body = stored_body(folder, row.object_id, source, config.faces)
    if row.label in (GIVEN, VARIED):  # on curved surfaces given contacts have faces of their own
        body = seat(body, row.points, row.normals).body
    return Recorded(
        name=name,
        body=body,
        contacts=row.placed,
        friction=row.friction,
        setup=Setup(),
        agenda=Agenda(random_wrenches=config.random_wrenches, seed=config.seed),
        control=None if row.force_closed else row.label,
        outcomes={
            each.name: each.hold.outcome.value for each in chosen.rows(TrialRow, grasp_id=name)
        },
    )
