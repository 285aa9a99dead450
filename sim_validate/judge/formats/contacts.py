"""Reads contacts alone: the contacts files and `grasps.json` that `graspproof analyze` reads.

The object of a contacts file is named like the file, that of a `grasps.json` in it. Friction in a
file is left alone, as judging has its own.
"""

from collections.abc import Iterator
from typing import Any, cast

from grasp_core.errors import InputError
from grasp_core.files.text_files import read_text
from grasp_core.planning.grasps_json import (
    ContactSet,
    Overrides,
    contact_sets_from_json,
    given_contact_sets,
)
from grasp_core.values import Contact
from sim_validate.datasets.given_grasps import NO_FRICTION
from sim_validate.judge.formats.fields import Source, entry, text
from sim_validate.judge.records import ContactRecord, GraspRecord

ANY_FRICTION = Overrides(NO_FRICTION)


def read(found: Any, source: Source) -> Iterator[GraspRecord]:
    """Read the contacts of each grasp; in a contacts file, one that is wrong loses only itself."""
    if "schema" in found:
        named = text(entry(found, "object"), "name")
        for each in contact_sets_from_json(read_text(source.path), ANY_FRICTION):
            yield _record(each, f"{source.name}#{each.id}", named)
        return
    alone = "contacts" in found
    listed = [found] if alone else entry(found, "grasps")
    if not isinstance(listed, list) or (alone and "grasps" in found):
        raise InputError('the file must have either "contacts", or "grasps" with a list')
    common = {name: found[name] for name in ("friction", "center_m", "torque_scale_m")
              if name in found}  # fmt: skip

    def record(grasp: Any, name: str) -> ContactRecord:
        file = grasp if alone else {**common, "grasps": [grasp]}
        (given,) = given_contact_sets(file, ANY_FRICTION)
        return _record(given, name, source.path.stem)

    grasps = cast("list[Any]", listed)
    yield from source.records(grasps, len(grasps), record)


def _record(given: ContactSet, name: str, object_name: str) -> ContactRecord:
    contacts = tuple(map(Contact, given.positions, given.normals))
    return ContactRecord(name, object_name, 1.0, contacts)
