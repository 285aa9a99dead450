"""Splits a configuration into units of work, each of which can be computed anywhere, in any order.

A unit is one object at one friction. Its name is a hash of all that decides its rows: the bytes of
the mesh and of the hand, the configuration, the versions of the packages, and this project's own
code. So results of an earlier run count exactly if they would come out the same.
"""

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cache
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path
from types import MappingProxyType

from grasp_core.errors import GraspError, InputError
from grasp_core.files.records import record_of
from grasp_core.objects.polyhedron import Polyhedron, load_polyhedron
from grasp_core.provenance import versions
from grasp_core.settings import as_table
from scenes.example_objects import example_object
from sim_validate.datasets.config import CREDITS, HAND, DatasetConfig
from sim_validate.datasets.given_grasps import GraspToJudge, read_given
from sim_validate.datasets.hand_files import joint_names
from sim_validate.planning.asked_objects import is_mesh_file

GIVEN_PER_UNIT = 25
"""Largest number of given grasps in one unit, which take half a minute."""
OWN_PACKAGES = ("grasp_core", "scenes", "sim_validate")
UNDECISIVE = ("objects", "frictions", "contacts", "outward", *CREDITS)
"""Settings that differ between units, or that decide no row."""


class WorkerError(GraspError):
    """Error of a worker process that cannot compute units of work."""


@dataclass(frozen=True, slots=True)
class WorkUnit:
    """One object at one friction, with some of the given grasps if there are any."""

    object: str
    """A mesh file as it was given, or the name of a built-in object."""
    path: Path | None
    """Absolute path of the mesh file; None for built-in objects."""
    source_sha256: str
    """Hash of the mesh file's bytes, or of the built-in object's mesh."""
    friction: float
    config: DatasetConfig
    given: tuple[GraspToJudge, ...] = ()
    """Grasps to judge; empty if grasps are to be planned."""
    hand: Path | None = None
    """Absolute path of the folder with the hand's files, called by their hash; None for none."""

    @property
    def groups(self) -> dict[str, int]:
        """Groups of columns that its tables have on request, with their sizes."""
        return self.config.groups(len(joint_names(self.hand)))

    @property
    def label(self) -> str:
        """Name of the object in files: as it was given, or the file's name if that is absolute.

        So the files do not depend on where a machine has its meshes.
        """
        return Path(self.object).name if Path(self.object).is_absolute() else self.object

    @property
    def id(self) -> str:
        """Name of the unit: 32 hexadecimal digits, the same wherever mesh and hand files lie."""
        table = as_table(self.config)
        settings = {name: value for name, value in table.items() if name not in UNDECISIVE}
        given = json.dumps([record_of(grasp) for grasp in self.given])
        digest = hashlib.sha256(given.encode()).hexdigest()
        if self.hand is not None:  # its hash stands for the path
            settings[HAND] |= {HAND: self.hand.name}
        own = sorted(provenance().items())
        decisive = [self.source_sha256, self.friction, digest, settings, own]
        return hashlib.sha256(json.dumps(decisive).encode()).hexdigest()[:32]


def units_sha256(units: Iterable[WorkUnit]) -> str:
    """Hash the names of units; two hashes are equal only if all rows come out the same."""
    return hashlib.sha256("".join(sorted(unit.id for unit in units)).encode()).hexdigest()


@cache
def provenance() -> Mapping[str, str]:
    """List the versions of all packages, and the hash of this project's own code.

    Apart from these, results depend only on how the processor rounds.
    """
    digest = hashlib.sha256()
    for package in OWN_PACKAGES:
        root = Path(str(files(package)))
        for path in sorted(root.rglob("*.py")):
            digest.update(f"{package}/{path.relative_to(root).as_posix()}\n".encode())
            digest.update(path.read_bytes())
    more = {"pyarrow": version("pyarrow"), "code_sha256": digest.hexdigest()}
    return MappingProxyType(versions() | more)


def units_of(config: DatasetConfig, hand: Path | None = None) -> list[WorkUnit]:
    """Split a configuration into units of work, each one object at one friction, sorted by name.

    The files of the hand, if there is one, are in a folder called by their hash.
    """
    hashes = {name: _source_sha256(name) for name in config.objects}
    paths = {name: Path(name).resolve() if is_mesh_file(name) else None for name in hashes}
    parts: list[tuple[GraspToJudge, ...]] = [()]
    if config.contacts:
        given = read_given(Path(config.contacts), outward=config.outward)
        parts = [given[i : i + GIVEN_PER_UNIT] for i in range(0, len(given), GIVEN_PER_UNIT)]
    units = [
        WorkUnit(
            name, paths[name], hashes[name], friction,
            replace(config, objects=(name,), frictions=(friction,)), part, hand,
        )
        for name in config.objects
        for friction in config.frictions
        for part in parts
    ]  # fmt: skip
    return sorted(units, key=lambda unit: unit.id)


def body_of(unit: WorkUnit) -> Polyhedron:
    """Load the object of a unit."""
    config = unit.config
    if unit.path is None:
        return example_object(unit.object)
    if not unit.path.is_file():
        raise WorkerError(
            f"{unit.path}: a worker process cannot find this mesh; all processes must share a "
            "file system"
        )
    if _source_sha256(str(unit.path)) != unit.source_sha256:
        raise WorkerError(
            f"{unit.path}: this mesh has changed since the build began; start the build again"
        )
    return load_polyhedron(unit.path, unit=config.unit, scale=config.scale, faces=config.faces)


def _source_sha256(name: str) -> str:
    if not is_mesh_file(name):
        return example_object(name).content_sha256
    try:
        with Path(name).open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError as error:
        raise InputError(f"{name}: the mesh file cannot be read ({error.strerror})") from error
