"""A public function or class with a call that succeeds, and what such calls are made of."""

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

import grasp_core as gc
import scenes
import sim_validate as sv
from tests.bad_input import mesh_texts
from tests.public_values.bad_values import PATH, USUAL

FOLDER = TemporaryDirectory()
WRENCH = np.array([0.0, 0.0, -1.0, 0.0, 0.0, 0.0])


@cache
def body():
    return scenes.example_object("tetrahedron")


@cache
def plan():
    return gc.plan(body(), limit=1)


@cache
def grasp():
    return plan().grasps[0]


@cache
def scene():
    return scenes.build_scene(body(), grasp())


@cache
def mesh_file():
    """An OBJ file, as long as the tests last."""
    path = Path(FOLDER.name) / "tetrahedron.obj"
    path.write_text(mesh_texts.obj(body().vertices.tolist(), body().triangles.tolist()))
    return path


@dataclass(frozen=True)
class Call:
    """A public function or class, and what is known of its arguments."""

    name: str
    """As users write it."""
    valid: Callable[[], Mapping[str, Any]]
    special: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    """What is refused, by argument and label, where the name of the argument does not say it."""
    succeeds_in: str = ""
    """The test that makes a call that succeeds, where that needs more than values."""
    slow: bool = False

    @property
    def target(self) -> Callable[..., Any]:
        package, _, rest = self.name.partition(".")
        found: Any = {"gc": gc, "scenes": scenes, "sv": sv}[package]
        for part in rest.split("."):
            found = getattr(found, part)
        return found

    @property
    def refused(self) -> Mapping[str, Mapping[str, Any]]:
        """What must be refused of each argument, by label."""
        names = inspect.signature(self.target).parameters
        return {name: USUAL[name] for name in names if name in USUAL} | self.special


def of_grasp(**more):
    return lambda: {"body": body(), "grasp": grasp(), **more}


def fields_of(kind, value):
    """The arguments that make such a value again."""
    return {each.name: getattr(value, each.name) for each in fields(kind) if each.init}


def reading(name, path, tested):
    """The call of a function that reads a file, with one that is not there."""
    return Call(
        name, lambda: {"path": path}, {"path": PATH | {"nowhere": path}}, succeeds_in=tested
    )
