"""Reads a file of the wrenches that a task needs, each of which a grasp must hold in full.

    {"wrenches": [{"name": "lift", "force_n": [0, 0, -3], "torque_n_m": [0, 0, 0]}, ...]}

Torques are about the centre of mass; forces and torques are in the object's frame. A torque may be
left out, which means zero.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np

from grasp_core.declared import Declared
from grasp_core.errors import InputError, about
from grasp_core.files.json_text import object_of, shown
from grasp_core.files.records import from_record
from grasp_core.files.text_files import read_text
from grasp_core.kinds import Many, Vector
from sim_validate.engine.setup import NamedWrench

MOST_WRENCHES = 10_000


@dataclass(frozen=True, slots=True)
class GivenWrench(Declared):
    """A wrench of a file."""

    name: str
    force_n: Vector
    torque_n_m: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class WrenchFile(Declared):
    """The wrenches of a file, all with different names."""

    wrenches: Annotated[tuple[GivenWrench, ...], Many(most=MOST_WRENCHES)]

    def _check_together(self) -> None:
        names: set[str] = set()
        for number, each in enumerate(self.wrenches):
            if each.name in names:
                raise InputError(
                    f"wrenches[{number}].name: expected wrenches with different names, got two "
                    f"named {shown(each.name)}"
                )
            names.add(each.name)


def wrenches_from_file(path: Path) -> tuple[NamedWrench, ...]:
    """Read the wrenches of a file."""
    text = read_text(path)
    with about(path):
        return wrenches_from_json(text)


def wrenches_from_json(text: str) -> tuple[NamedWrench, ...]:
    """Parse the wrenches in the text of a file."""
    given = from_record(WrenchFile, object_of(text, "wrench file", nulls=False))
    return tuple(
        NamedWrench(each.name, np.array([*each.force_n, *each.torque_n_m]))
        for each in given.wrenches
    )


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
