"""Reads and writes files: tables of TOML, paths that files name, arrays, and whole folders.

An npz archive may claim any size, hold a name twice, or have members with wrong headers. Only
arrays of numbers and truth values are read, with exactly as many bytes as their shapes need, and
each is checked before much memory is used. Files and folders that are written are complete or
absent.
"""

import fcntl
import io
import math
import os
import re
import shutil
import tempfile
import tomllib
import zipfile
from collections.abc import Collection, Generator, Iterable, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from grasp_core.declared import Declared
from grasp_core.errors import InputError, about
from grasp_core.figures import scalars
from grasp_core.files.json_text import DEEPEST, check_values, shown
from grasp_core.files.records import RecordFile
from grasp_core.files.text_files import SHOWN, UNFINISHED, read_bytes, read_text, write_parts
from grasp_core.grasp_tables import ById, Named, frame_of
from grasp_core.kinds import Friction
from grasp_core.objects.polyhedron import Polyhedron


@dataclass(frozen=True, slots=True, repr=False)
class AboutObject(Declared):
    """The object that a file is about."""

    name: str
    source_sha256: str
    """Hash of the file or built-in mesh that the object was read from; empty if there is none."""
    content_sha256: str
    """Hash of its canonical mesh, as in `Polyhedron.content_sha256`."""

    @classmethod
    def of(cls, body: Polyhedron) -> Self:
        """Say which object this is."""
        return cls(body.name, body.source_sha256, body.content_sha256)


Item = TypeVar("Item", bound=Named)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class AboutGrasps(RecordFile, ById[Item]):
    """Base of files about the grasps of an object.

    They are sequences, as a plan is: `len`, iteration, `[0]`, `["c-0-1-2-7"]` and slices.
    """

    object: AboutObject
    friction: Friction
    """Coulomb coefficient at every contact."""
    complete: bool
    """Whether every grasp that was asked for was dealt with."""

    @property
    def object_sha256(self) -> str:
        """Hash of the object's canonical mesh, as in `Polyhedron.content_sha256`."""
        return self.object.content_sha256

    def to_dataframe(self) -> Any:
        """Return a `pandas.DataFrame` with a row for each grasp, indexed by its id.

        It has a column for each figure of a result that is a number or a word; of lists, how many
        items they have. Figures are NaN where there is no result.

        Raises:
            InputError: The library pandas is not installed.
        """
        return frame_of([scalars(each) for each in self], [each.id for each in self])


LONGEST = 500
"""Largest number of characters of a path in a file."""


def require_inside(name: object, field: str) -> str:
    """Check that a path is relative and has no `..`."""
    if not isinstance(name, str) or not name or len(name) > LONGEST:
        raise InputError(f"{field}: expected the path of a file, got {shown(name)}")
    parts = PurePosixPath(name).parts
    plain = name.isprintable() and "\\" not in name and ":" not in name
    if name.startswith("/") or ".." in parts or not parts or not plain:
        raise InputError(
            f"{field}: expected a relative path that stays in the file's folder, got {shown(name)}"
        )
    return name


def path_inside(folder: Path, name: str) -> Path:
    """Return the path of a file in a folder, after a check that no link leads out of it."""
    path = folder / require_inside(name, "path")
    if not path.resolve().is_relative_to(folder.resolve()):
        raise InputError(f"{path}: this link leads out of {folder}; copy the file into the folder")
    return path


MOST_LETTERS = 2**20
"""Largest number of characters of a settings file, which is usually short."""
ASIDE = re.compile(
    r'''"""(?:[^\\]|\\.)*?(?:"""|\\?\Z)|"(?:[^"\\\n]|\\.)*(?:"|\n|\\?\Z)|'''
    r"""'''.*?(?:'''|\Z)|'[^'\n]*(?:'|\n|\Z)|\#[^\n]*""",
    re.DOTALL,
)
"""Pattern of quoted text and comments, in which dots are no key separators."""
LONG_KEY = re.compile(rf"(?<![\w-])(?:[\w-]++[ \t]*+\.[ \t]*+){{{DEEPEST}}}")
"""Pattern of a key `a.b.c` with too many parts. The time of tomllib grows with the cube of their
number: two minutes for a hundred kilobytes."""


def read_tables(path: Path) -> dict[str, Any]:
    """Read the tables of a TOML file."""
    text = read_text(path, MOST_LETTERS)
    with about(path):
        return tables_of_toml(text)


def tables_of_toml(text: str) -> dict[str, Any]:
    """Parse the tables of a TOML text."""
    if LONG_KEY.search(ASIDE.sub(lambda found: "q" if found[0][0] != "#" else "", text)):
        raise InputError(f"a key of the TOML file has more than {DEEPEST} parts; use shorter keys")
    try:
        found = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"the text is not TOML: {_printable(str(error))}") from error
    except RecursionError as error:
        raise InputError(
            "values of the TOML file are nested too deeply; use fewer levels"
        ) from error
    except ValueError as error:  # numbers of thousands of digits, days that do not exist
        raise InputError(f"the text is not TOML: {_printable(str(error))}") from error
    check_values(found)
    return found


def _printable(text: str) -> str:
    return "".join(letter if letter.isprintable() else " " for letter in text[:200])


MOST_BYTES = 256 * 2**20
"""Largest total size of the arrays in a file."""
MOST_MEMBERS = 256
MOST_HEADER = 10_000
"""Largest number of characters in an array's header, a limit of numpy's."""
KINDS = "biuf"
"""Kinds of arrays that are read: truth values and numbers."""
BEGINNING, ENDING = b"PK\x03\x04", ".npy"
"""First bytes of a zip archive, and ending of the array names inside it."""


def read_arrays(path: Path, names: Collection[str]) -> dict[str, NDArray[Any]]:
    """Read the named arrays of an npz file that exist; nothing in the file is executed."""
    data = read_bytes(path, MOST_BYTES)
    with about(path):
        return arrays_of(data, names)


def arrays_of(data: bytes, names: Collection[str]) -> dict[str, NDArray[Any]]:
    """Read the named arrays that exist from the bytes of an npz file."""
    if not data.startswith(BEGINNING):
        raise InputError(
            "expected an npz file, which begins as a zip archive does; save it with numpy.savez"
        )
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            members = _checked(archive.infolist())
            return {
                name: _array(archive, members[name + ENDING], name)
                for name in names
                if name + ENDING in members
            }
    except InputError:
        raise
    except Exception as error:  # a damaged file can make zipfile and numpy raise anything
        raise InputError(
            f"the file cannot be read as npz ({shown(str(error))}); save it again with numpy.savez"
        ) from error


def _checked(listed: list[zipfile.ZipInfo]) -> dict[str, zipfile.ZipInfo]:
    """Index the arrays of an archive by name, and refuse an archive that claims too much."""
    if len(listed) > MOST_MEMBERS:
        raise InputError(
            f"the npz file has {len(listed)} members, more than the {MOST_MEMBERS} arrays allowed"
        )
    claimed = sum(each.file_size for each in listed)
    if claimed > MOST_BYTES:
        raise InputError(
            f"the arrays of the npz file take {claimed} bytes, over the limit of {MOST_BYTES}; "
            "save fewer numbers"
        )
    members = {each.filename: each for each in listed}
    if len(members) < len(listed):
        raise InputError("two arrays of the npz file have the same name; write the file again")
    return members


def _array(archive: zipfile.ZipFile, member: zipfile.ZipInfo, name: str) -> NDArray[Any]:
    with archive.open(member) as stream:
        version = np.lib.format.read_magic(stream)
        readers = {(1, 0): np.lib.format.read_array_header_1_0,
                   (2, 0): np.lib.format.read_array_header_2_0}  # fmt: skip
        if version not in readers:
            raise InputError(
                f"{name}: expected an array in npy format 1.0 or 2.0, got {version}; save it again"
            )
        shape, by_columns, dtype = readers[version](stream, max_header_size=MOST_HEADER)
        if dtype.kind not in KINDS or dtype.subdtype is not None:
            raise InputError(f"{name}: expected an array of numbers, got {shown(str(dtype))}")
        size = math.prod(shape) * dtype.itemsize
        if min(shape, default=0) < 0 or size > member.file_size:
            raise InputError(
                f"{name}: the array's shape {shown(str(shape))} does not fit its data; save it "
                "again"
            )
        held = stream.read(size)
        if len(held) < size or stream.read(1):
            raise InputError(
                f"{name}: the array does not hold as many numbers as its shape {shape} needs"
            )
    return np.ndarray(shape, dtype, held, order="F" if by_columns else "C")


def write_lines(path: Path, lines: Iterable[str]) -> Path:
    """Write lines as `write_text` does, one at a time; each ends with its own line break."""
    return write_parts(path, (line.encode() for line in lines))


def write_arrays(path: Path, arrays: Mapping[str, NDArray[Any]]) -> Path:
    """Write named arrays, compressed, as `numpy.load` reads them."""
    held = io.BytesIO()
    with zipfile.ZipFile(held, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, array in arrays.items():
            # A member made this way has a fixed date, so that equal arrays give equal files.
            member = zipfile.ZipInfo(f"{name}.npy")
            with archive.open(member, "w") as stream:
                np.lib.format.write_array(stream, array, allow_pickle=False)
    return write_parts(path, [held.getvalue()])


@contextmanager
def whole_folder(folder: Path) -> Generator[Path]:
    """Yield a temporary folder that becomes `folder` on success, and is removed on failure."""
    if folder.exists() and not (folder.is_dir() and not any(folder.iterdir())):
        raise InputError(f"{folder}: exists and is not an empty folder; give another --out")
    named = folder.resolve()
    named.parent.mkdir(parents=True, exist_ok=True)
    prefix = f".{named.name[:SHOWN]}{UNFINISHED}"
    for path in named.parent.iterdir():
        if path.name.startswith(prefix):
            with suppress(OSError), _locked(path) as abandoned:
                if abandoned:
                    shutil.rmtree(path)
    temporary = Path(tempfile.mkdtemp(dir=named.parent, prefix=prefix))
    try:
        with _locked(temporary):
            yield temporary
            temporary.chmod(0o755)
            temporary.replace(named)
    except BaseException:
        shutil.rmtree(temporary, ignore_errors=True)
        raise


@contextmanager
def _locked(folder: Path) -> Generator[bool]:
    """Lock a folder until the end of the block, or of the process; yield whether that worked."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            locked = True
        except OSError:  # another process has locked it, or the file system has no locks
            locked = False
        yield locked
    finally:
        os.close(handle)
