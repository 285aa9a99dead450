"""Reads the text of a hand's file and the files that it names, within bounds, for MuJoCo.

MuJoCo's compiler reads any file that a model names. Here the model's files are read first, up to a
size, and handed over in memory; the text that is compiled names nothing on disk. They are read from
the model's own folder and the package that it is in, and where no package is known, models and
shapes also from folders beside the model's, as in `urdf` and `meshes`. Whether a model can do
without a mesh that cannot be read is found where it is compiled. Elements that attach other models,
run code or copy parts are refused.
"""

import importlib
import re
from collections import deque
from collections.abc import Container, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from grasp_core.errors import InputError, about
from grasp_core.files.text_files import bounded_bytes
from scenes.hand_files.left_out import without_missing, without_unused

LARGEST_TEXT, LARGEST_FILES = 4 * 2**20, 64 * 2**20
"""Largest size of the text, and of all files that it names together [bytes]."""
LARGEST_MANIFEST = 2**16
MOST_FILES, MOST_ELEMENTS = 500, 20_000
REFUSED = ("include", "model", "plugin", "extension", "replicate", "composite", "flexcomp",
           "attach")  # fmt: skip
"""Elements that attach other models, run code or make copies in any number."""
MOST_PIXELS = 4096
"""Largest value of the attributes that say how large fields of heights are."""
COUNTS = ("nrow", "ncol")
MESH_FOLDERS, OTHER_FOLDERS = ("meshdir", "assetdir"), ("texturedir", "strippath")
"""Attributes that say where files are."""
NAMED_BY_FILES = ("mesh", "hfield")
"""Elements that are called like their files where they have no name."""
PACKAGE = re.compile(r"(?:package|model)://([^/]*)/+")
"""What begins the names of files in URDF, with the name of a package."""
MESHES = (".stl", ".obj", ".msh")
BESIDE_ENDINGS = (*MESHES, ".png", ".xml", ".mjcf")
"""Files that may lie in folders beside the model's."""
PARENTS_TRIED = 4
"""Number of folders above the model's that may be the package's."""
PACKAGE_FILE = "package.xml"
"""File in the folder of a ROS package that says how it is called."""
MOST_PARTS = 8
"""Number of last parts of a file's name with which it is looked for."""
MOBILE = {"revolute", "continuous", "prismatic"}
"""Kinds of URDF joints that move by one number."""
PLAIN_NAME = re.compile(r"[\w.-]+", re.ASCII)
MOST_LISTED = 8


@dataclass(frozen=True, slots=True)
class ModelText:
    """The text of a model that names no file on disk."""

    xml: str
    files: dict[str, bytes]  # the files that it names, by the names in it
    unread: dict[str, str]  # why some are empty, which are meshes that could not be read
    notes: tuple[str, ...] = ()  # sentences about what was read otherwise


def model_text(path: Path) -> ModelText:
    """Read a model's text and the files that it names."""
    etree: Any = importlib.import_module("xml.etree.ElementTree")
    raw = _bytes(path, LARGEST_TEXT)
    root = _parsed(raw, etree)
    folders = [path.parent]
    if root.tag == "mujoco":
        with about("<include>"):
            folders = _with_includes(root, path, LARGEST_TEXT - len(raw), etree)
    obsolete, lost = without_unused(root), without_missing(root)
    kinds = {joint.get("name"): joint.get("type") for joint in root.findall("joint")}
    for joint in root.findall("joint"):  # MuJoCo would take those that follow a fixed one as free
        mimic = joint.find("mimic")
        if mimic is not None and not {kinds.get(mimic.get("joint")), joint.get("type")} <= MOBILE:
            raise InputError(
                f"joint {joint.get('name')} must follow a joint that moves, got <mimic> "
                f"of {mimic.get('joint')}; name another joint there, or remove it"
            )
    for inertial in root.iterfind("link/inertial"):
        if inertial.find("inertia") is None:  # as of a point; masses are all that counts
            axes = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
            inertial.append(etree.Element("inertia", dict.fromkeys(axes, "0")))
    notes = (
        *_with_shapes(root),
        *note("attributes that MuJoCo no longer has are left out", obsolete),
        *note("motors, tendons and contacts of parts that the file lacks are left out", lost),
    )
    elements = list(root.iter())
    if root.tag not in {"mujoco", "robot"} or len(elements) > MOST_ELEMENTS:
        raise InputError(
            f"expected <mujoco> or <robot> with at most {MOST_ELEMENTS} elements, got "
            f"<{str(root.tag)[:40]}> with {len(elements)}"
        )
    for element in elements:
        _check_element(element)
    files, unread = _with_files(folders, elements, root.tag == "mujoco")
    return ModelText(etree.tostring(root, encoding="unicode"), files, unread, notes)


def _parsed(raw: bytes, etree: Any) -> Any:
    if b"<!DOCTYPE" in raw or b"<!ENTITY" in raw:
        raise InputError("a hand's file must not declare entities; remove <!DOCTYPE ...>")
    try:
        return etree.fromstring(raw)
    except etree.ParseError as error:
        raise InputError(f"expected an MJCF or URDF file, but it is no XML: {error}") from error


def _with_includes(root: Any, path: Path, left: int, etree: Any) -> list[Path]:
    """Put the elements of included files in the place of <include>, and return all folders.

    Names are relative to the folder of the model, the first of these, or of the including file.
    """
    folders, known, parents = [path.parent], {path.resolve()}, deque([(root, path.parent)])
    while parents:
        parent, folder = parents.popleft()
        waiting, kept = deque((each, folder) for each in parent), list[Any]()
        while waiting:
            element, folder = waiting.popleft()
            if element.tag != "include":
                kept.append(element)
                parents.append((element, folder))
                continue
            given = element.get("file", "")
            found = _found(given, [path.parent, folder], taken=known)
            if found in known or len(known) > MOST_FILES:
                raise InputError(
                    f"names the file {given[:80]!r} once more, but a model includes a file once, "
                    f"and {MOST_FILES} files at most; write out what further ones stand for"
                )
            content = _bytes(found, left)
            left -= len(content)
            known.add(found)
            folders.append(found.parent)
            inner = [(each, found.parent) for each in _parsed(content, etree)]
            waiting.extendleft(reversed(inner))
        parent[:] = kept
    return folders


def _with_shapes(root: Any) -> tuple[str, ...]:
    """Let visual shapes of URDF links collide where there are no others; return notes."""
    lent, bare = list[str](), list[str]()
    for link in root.findall("link"):
        visuals, known = link.findall("visual"), link.find("collision") is not None
        for visual in visuals:
            meshes = [mesh.get("filename", "") for mesh in visual.iter("mesh")]
            if known or not all(Path(name).suffix.lower() in MESHES for name in meshes):
                link.remove(visual)
            else:
                visual.tag = "collision"
        if visuals and not known:
            (bare if link.find("collision") is None else lent).append(link.get("name", "?"))
    unread = f"whose visual ones are in files other than {', '.join(MESHES)}, touch nothing"
    return (
        *note("links without collision shapes collide with their visual ones", lent),
        *note(f"links without collision shapes, {unread}", bare),
    )


def note(text: str, names: list[str]) -> tuple[str, ...]:
    """Return a sentence about what has these names; nothing where nothing has."""
    return (f"{text}: {listed(names)}",) if names else ()


def listed(names: list[str]) -> str:
    """List names for a note, the first of many."""
    more = len(names) - MOST_LISTED
    return ", ".join(names[:MOST_LISTED]) + (f" and {more} more" if more > 0 else "")


def _check_element(element: Any) -> None:
    """Refuse an element that reads, runs or makes what the file does not hold."""
    if element.tag in REFUSED:
        raise InputError(
            f"<{element.tag}> is not read in a hand's file; write out what it stands for"
        )
    if element.tag == "size":  # how much memory MuJoCo takes
        element.attrib.clear()
    for key in COUNTS if element.tag == "hfield" else ():
        if len(element.get(key, "0")) > len(str(MOST_PIXELS)):
            raise InputError(
                f"{key} of <{element.tag}> must be at most {MOST_PIXELS}, got "
                f"{element.get(key)[:40]}"
            )


def _with_files(
    folders: list[Path], elements: list[Any], is_mjcf: bool
) -> tuple[dict[str, bytes], dict[str, str]]:
    """Read the files that elements name, and give them names of their own.

    Gives also why meshes cannot be read, which are without content then.
    """
    stated = _stated_folders(elements)
    files, names, left = dict[str, bytes](), dict[str, str](), LARGEST_FILES
    unread = dict[str, str]()
    for element in elements:
        for key in [key for key in element.attrib if key.startswith("file")]:
            given = element.attrib[key]
            if given not in names:
                try:
                    found = _found(given, folders, stated)
                    content, names[given] = _bytes(found, left), _own_name(found, files)
                except InputError as error:
                    if element.tag != "mesh":
                        raise
                    content, names[given] = b"", _own_name(Path("?.obj"), files)
                    unread[names[given]] = str(error)
                files[names[given]] = content
                left -= len(content)
            if len(names) > MOST_FILES:
                raise InputError(f"names more than {MOST_FILES} files")
            if element.tag in NAMED_BY_FILES and is_mjcf:  # unnamed ones are called so
                element.attrib.setdefault("name", Path(given).stem)
            element.attrib[key] = names[given]
    return files, unread


def _own_name(found: Path, files: dict[str, bytes]) -> str:
    """Name a file in the compiler's messages as it is, if that name is plain and free."""
    free = found.stem.lower() not in {Path(name).stem.lower() for name in files}
    plain = PLAIN_NAME.fullmatch(found.name) is not None
    return found.name if free and plain else f"file+{len(files)}{found.suffix.lower()}"


def _stated_folders(elements: list[Any]) -> list[str]:
    """Return the folders that a model states, relative to its own; the model forgets them."""
    stated = list[str]()
    for element in elements:
        if element.tag == "compiler":
            for key in [*MESH_FOLDERS, *OTHER_FOLDERS]:
                value = element.attrib.pop(key, None)
                if value is not None and key in MESH_FOLDERS:
                    stated.append(value)
    return list(dict.fromkeys(stated))


def _found(
    given: str, folders: list[Path], stated: Sequence[str] = (), taken: Container[Path] = ()
) -> Path:
    """Find a named file near the model, or in the package that the name begins with.

    The first folder is the model's; stated ones are relative to all. A file that is elsewhere is
    looked for by the last parts of its name, below the model's folder and those above, because
    simulators start in other folders; files that are taken are not found so.
    """
    home, package = folders[0].resolve(), PACKAGE.match(given)
    name = given[package.end() :] if package else given
    below, above = [*stated, ""], (home, *home.parents[:PARENTS_TRIED])
    tried = [(None, folder / value / name) for folder in folders for value in stated or below]
    if package:
        tried += [(root, root / name) for root in _roots(home, package[1])]
    exact = len(tried)
    names = [Path(value, name).parts for value in below]
    tails = {Path(*parts[-n:]): n for n in range(MOST_PARTS, 0, -1) for parts in names}
    for tail in sorted(tails, key=tails.__getitem__, reverse=True):  # the most parts first
        tried += [(None, folder / tail) for folder in above]
    tried += [
        (None, folder / value / own)
        for own in (name, Path(name).name) for folder in folders for value in below
    ]  # fmt: skip
    around = _package_around(home)
    for number, (root, each) in enumerate(tried):
        try:
            whole = each.resolve()
            inside = whole.is_relative_to(root) if root else _is_near(whole, home, around)
            if inside and whole.is_file() and (number < exact or whole not in taken):
                return whole
        except (OSError, ValueError, RuntimeError):
            continue
    said = f", and not in a package {package[1]} around it" if package else ""
    raise InputError(
        f"names the file {given[:80]!r}, which is not in the folder of the model nor in one beside "
        f"it{said}; put it there, or a {PACKAGE_FILE} into the folder of all files of the hand"
    )


def _is_near(whole: Path, home: Path, around: Path | None) -> bool:
    """Return whether a file is in the model's folder or package, or may lie in a folder beside."""
    if whole.is_relative_to(home) or (around is not None and whole.is_relative_to(around)):
        return True
    above = home.parent
    # what holds the home folder, or is it, holds more than hands
    if Path.home().resolve().is_relative_to(above) or not whole.is_relative_to(above):
        return False
    folder, *inner = whole.relative_to(above).parts
    hidden = any(part.startswith(".") for part in (folder, *inner))
    return bool(inner) and not hidden and whole.suffix.lower() in BESIDE_ENDINGS


def _package_around(home: Path) -> Path | None:
    """Return the nearest folder with a manifest that a model is in."""
    around = (home, *home.parents[:PARENTS_TRIED])
    return next((above for above in around if (above / PACKAGE_FILE).is_file()), None)


def _roots(home: Path, package: str) -> list[Path]:
    """Return the folders of a package in which a model is, or beside those that it is in.

    Folders beside must be called like the package and have a manifest that says so; for those in
    which the model is, one of both is enough.
    """
    if not PLAIN_NAME.fullmatch(package) or package.startswith("."):
        return []
    found = list[Path]()
    for above in (home, *home.parents[:PARENTS_TRIED]):
        if above.name == package or _is_called(above, package):
            found.append(above)
        if _is_called(above / package, package):
            found.append((above / package).resolve())
    return found


def _is_called(folder: Path, package: str) -> bool:
    try:
        with (folder / PACKAGE_FILE).open("rb") as file:
            said = re.search(rb"<name>\s*([\w.-]+)\s*</name>", file.read(LARGEST_MANIFEST))
    except OSError:
        return False
    return said is not None and said[1].decode() == package


def _bytes(path: Path, most: int) -> bytes:
    try:
        with about(path.name):
            content = bounded_bytes(path, most)
    except OSError as error:
        raise InputError(f"{path.name} cannot be read: {error.strerror or error}") from error
    if len(content) > most:
        raise InputError(
            f"a hand's text may have {LARGEST_TEXT >> 20} MiB and its files "
            f"{LARGEST_FILES >> 20} MiB together; {path.name} exceeds that"
        )
    return content
