"""Reads and writes files: tables of TOML, paths that files name, arrays, and whole folders.

An npz archive may claim any size, or hold a name twice: that is checked before anything is read.
Only arrays of numbers and truth values are read, and nothing in a file is executed. Files and
folders that are written are complete or absent.

A folder of results is kept whole: one command at a time writes to it, and removes old results.
Results that would contradict new ones are removed first, so that old and new results never mix,
whatever ends a command. Files of other names are left alone.
"""

import io
import re
import shutil
import tempfile
import tomllib
import zipfile
from collections.abc import Collection, Generator, Iterable, Mapping
from contextlib import contextmanager, suppress
from dataclasses import field
from datetime import date, time
from pathlib import Path, PurePosixPath
from typing import Any, Self, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from grasp_core.declared import Declared, declared
from grasp_core.errors import InputError, about
from grasp_core.figures import scalars
from grasp_core.files.file_kinds import BESIDE, GRASPS, REGIONS, VERDICTS
from grasp_core.files.json_text import shown
from grasp_core.files.records import RecordFile
from grasp_core.files.text_files import (
    SHOWN,
    UNFINISHED,
    read_bytes,
    read_text,
    remove_unfinished,
    write_parts,
    write_text,
)
from grasp_core.grasp_tables import ById, Named, frame_of
from grasp_core.kinds import Friction
from grasp_core.messages import at
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.provenance import versions
from sim_validate.kit.locks import entries, locked


@declared
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


@declared
class ResultFile(RecordFile):
    """Base of files that say which versions made them."""

    versions: Mapping[str, str | None] = field(
        default_factory=versions, compare=False, kw_only=True
    )
    """Versions of every package that can change a number."""


@declared
class AboutGrasps(ResultFile, ById[Item]):
    """Base of files about the grasps of an object.

    They are sequences, as a plan is: `len`, iteration, `[0]`, `["c-0-1-2-7"]` and slices.
    """

    object: AboutObject
    friction: Friction
    """Coulomb coefficient at every contact."""
    complete: bool = field(kw_only=True)
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
MOST_SAID = 200
"""Largest number of characters of what the parser says of a text."""
ASIDE = re.compile(
    r'''"""(?:[^\\]|\\.)*?(?:"""|\\?\Z)|"(?:[^"\\\n]|\\.)*(?:"|\n|\\?\Z)|'''
    r"""'''.*?(?:'''|\Z)|'[^'\n]*(?:'|\n|\Z)|\#[^\n]*""",
    re.DOTALL,
)
"""Pattern of quoted text and comments, in which dots are no key separators."""
DEEPEST = 64
"""Largest number of parts of a key."""
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
    except RecursionError as error:
        raise InputError(
            "values of the TOML file are nested too deeply; use fewer levels"
        ) from error
    except ValueError as error:  # numbers of thousands of digits and days that do not exist, too
        raise InputError(f"the text is not TOML: {str(error)[:MOST_SAID]}") from error
    _check_no_dates(found)
    return found


def _check_no_dates(found: Any, where: str = "") -> None:
    """Refuse days and times of TOML, which no setting is."""
    if isinstance(found, date | time):
        raise InputError(f"{where}: expected a number or text, got {found}; put it in quotes")
    if isinstance(found, dict):
        for name, each in cast("dict[str, Any]", found).items():
            _check_no_dates(each, at(where, name))
    elif isinstance(found, list):
        for place, each in enumerate(cast("list[Any]", found)):
            _check_no_dates(each, f"{where}[{place}]")


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
        found: NDArray[Any] = np.lib.format.read_array(
            stream, allow_pickle=False, max_header_size=MOST_HEADER
        )
        if found.dtype.kind not in KINDS or stream.read(1):
            raise InputError(
                f"{name}: expected an array of numbers with nothing behind them, got one of "
                f"{shown(str(found.dtype))}; save it again"
            )
    return found


def write_arrays(path: Path, arrays: Mapping[str, NDArray[Any]]) -> Path:
    """Write named arrays as `numpy.load` reads them; equal arrays give equal files."""
    held = io.BytesIO()
    np.savez(held, allow_pickle=False, **arrays)
    return write_parts(path, [held.getvalue()])


MADE = "made"
"""Name of a folder that is being filled, inside its temporary folder."""


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
            with suppress(OSError), locked(path) as ended:
                if ended:
                    shutil.rmtree(path / MADE, ignore_errors=True)
            with suppress(OSError):  # it holds something while its command is at work
                path.rmdir()
    temporary = Path(tempfile.mkdtemp(dir=named.parent, prefix=prefix))
    try:
        with locked(temporary) as alone:
            if alone is False:
                raise _taken(folder)
            made = temporary / MADE
            made.mkdir()
            yield made
            with suppress(FileNotFoundError):  # Windows renames onto nothing
                named.rmdir()
            made.rename(named)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def _taken(folder: Path) -> InputError:
    return InputError(f"{folder}: another command is writing to it; wait, or give another --out")


REPORT, INDEX, GRASP_PAGES = "report", "index.html", "grasps"
STYLE = "style.css"
STATIC = (STYLE, "gallery.js", "tables.js", "turntable.js")
BEST_PROOF = "best-proof.npz"
OF_EACH_GRASP: dict[str, tuple[str, str, bytes]] = {
    VERDICTS: ("traces", ".npz", b".times_s.npy"),
    REGIONS: ("proofs", ".npz", b"object_sha256.npy"),
    GRASPS: ("scenes", ".xml", b"`graspproof scene"),
}
"""Folder, ending and distinctive bytes of those files of which each grasp has one, by the file of
results that they belong to."""
PICTURES, CLIPS = "pictures", "clips"
MARK = ".graspproof-report"
MARKED = "The pages here were written by graspproof, which may replace them.\n"
ID = re.compile(r"[bcprf](-\d+){4}[\w-]*", re.ASCII)
"""Pattern of a grasp's id, as plans name grasps; people give other ids to contacts of their own."""
OF_REPORT = (
    INDEX, *STATIC, "object-*.js", f"{GRASP_PAGES}/*.html", f"{PICTURES}/*.svg", f"{CLIPS}/*.webp",
)  # fmt: skip
"""Patterns of the files of a report, the first page first."""
PAGES = ("", GRASP_PAGES, PICTURES, CLIPS)
PARTS = ("scenes", "traces", "proofs", *PAGES, *(f"{REPORT}/{part}" for part in PAGES))
"""Subfolders into which commands write."""


def remove_results(folder: Path, file: str = GRASPS) -> None:
    """Remove a file of results, and pages that show them; a grasps.json takes all others along."""
    remove_report(folder / REPORT)
    for each in (*BESIDE, GRASPS) if file == GRASPS else (file,):
        _remove([folder / each])
        if each in OF_EACH_GRASP:
            part, suffix, mark = OF_EACH_GRASP[each]
            _remove([
                path for path in (folder / part).glob(f"*{suffix}")
                if ID.fullmatch(path.stem) or (path.is_file() and mark in path.read_bytes())
            ])  # fmt: skip
    if file == GRASPS:
        _remove([folder / BEST_PROOF])


def _remove(paths: Iterable[Path]) -> None:
    for path in paths:
        path.unlink(missing_ok=True)


def require_report_folder(folder: Path) -> None:
    """Refuse to write pages into a folder that is neither empty nor a report."""
    if folder.is_dir() and entries(folder) and not (folder / MARK).is_file():
        raise InputError(
            f"{folder}: this folder holds other files than a report; give another --out"
        )


@contextmanager
def new_pages(folder: Path) -> Generator[Path]:
    """Yield the folder to write the pages of a report to.

    That is the report's own folder if it has no pages. Otherwise it is one inside it, whose files
    replace the old pages at the end, so that these stay if the new ones are not finished.
    """
    earlier = (folder / INDEX).is_file()
    if not earlier:
        remove_pages(folder)
    write_text(folder / MARK, MARKED)
    if not earlier:
        try:
            yield folder
        except BaseException:
            remove_report(folder)
            raise
        return
    aside = Path(tempfile.mkdtemp(dir=folder, prefix=f".{REPORT}{UNFINISHED}"))
    try:
        yield aside
        remove_pages(folder)
        files = [path for path in aside.rglob("*") if path.is_file()]
        for path in sorted(files, key=lambda each: each.name == INDEX):
            place = folder / path.relative_to(aside)
            place.parent.mkdir(exist_ok=True)
            path.replace(place)
    finally:
        shutil.rmtree(aside, ignore_errors=True)


def remove_report(folder: Path) -> None:
    """Remove a report, if there is one, and nothing else; its mark is removed last."""
    if not (folder / MARK).is_file():
        return
    remove_pages(folder)
    if entries(folder) == [folder / MARK]:
        (folder / MARK).unlink()
        with suppress(OSError):  # a command is at work in it
            folder.rmdir()


def remove_pages(folder: Path) -> None:
    """Remove the pages of a report, the first page first; its mark stays."""
    for pattern in OF_REPORT:
        _remove(folder.glob(pattern))
    for kind in (GRASP_PAGES, PICTURES, CLIPS):
        part = folder / kind
        if part.is_dir() and not any(part.iterdir()):
            part.rmdir()


@contextmanager
def alone_in(folder: Path | None) -> Generator[None]:
    """Lock a folder, making it if needed, and remove unfinished files of interrupted commands.

    Enter this context before work begins, so that a folder that takes no files is refused at once,
    and not after the work. Without a folder it does nothing.
    """
    if folder is None:
        yield
        return
    made = _make(folder)
    try:
        with locked(folder) as alone:
            if alone is False:
                raise _taken(folder)
            for part in PARTS:
                remove_unfinished(folder / part)
            yield
    finally:
        with suppress(OSError):  # a folder that holds something stays
            for path in made:
                path.rmdir()


def _make(folder: Path) -> list[Path]:
    """Make the folder, check that files can be written there, and list the new folders."""
    try:
        missing = [path for path in (folder, *folder.parents) if not path.exists()]
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder) as stream:
            stream.write(b"0")
    except (FileExistsError, NotADirectoryError) as error:
        raise InputError(
            f"{error.filename}: exists and is not a folder; give another --out"
        ) from error
    except OSError as error:
        raise InputError(
            f"{folder}: no file can be written there ({error.strerror}); give another --out"
        ) from error
    return missing
