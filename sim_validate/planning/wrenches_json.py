"""Reads a file of the wrenches that a task needs, each of which a grasp must hold in full.

    {"wrenches": [{"name": "lift", "force_n": [0, 0, -3], "torque_n_m": [0, 0, 0]}, ...]}

Torques are about the centre of mass; forces and torques are in the object's frame. A torque may be
left out, which means zero.
"""

from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from grasp_core.errors import InputError, about
from grasp_core.files.json_text import place, record_of, shown
from grasp_core.files.text_files import read_text
from sim_validate.engine.setup import NamedWrench
from sim_validate.kit.fields import Triple

MOST_WRENCHES = 10_000


class _Given(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    name: str
    force_n: Triple
    torque_n_m: Triple = (0.0, 0.0, 0.0)


class _WrenchFile(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    wrenches: Annotated[list[_Given], Field(min_length=1, max_length=MOST_WRENCHES)]


def wrenches_from_file(path: Path) -> tuple[NamedWrench, ...]:
    """Read the wrenches of a file."""
    text = read_text(path)
    with about(path):
        return wrenches_from_json(text)


def wrenches_from_json(text: str) -> tuple[NamedWrench, ...]:
    """Parse the wrenches in the text of a file."""
    given = record_of(_WrenchFile, text, "wrench file", nulls=False).wrenches
    found: dict[str, NamedWrench] = {}
    for number, each in enumerate(given):
        if each.name in found:
            where = place(["wrenches", number, "name"])
            raise InputError(
                f"{where}: expected wrenches with different names, got two named {shown(each.name)}"
            )
        with about(place(["wrenches", number])):
            wrench = np.array([*each.force_n, *each.torque_n_m])
            found[each.name] = NamedWrench(each.name, wrench)
    return tuple(found.values())


def weights(
    weight_n: float, downs: tuple[tuple[float, float, float], ...]
) -> tuple[NamedWrench, ...]:
    """Turn the object's weight into wrenches, one for each direction of gravity."""
    ways = [np.array(down) for down in downs] or [*np.eye(3), *-np.eye(3)]
    return tuple(
        NamedWrench(
            f"weight_{place}", np.concatenate([weight_n * way / np.linalg.norm(way), np.zeros(3)])
        )
        for place, way in enumerate(ways)
    )
