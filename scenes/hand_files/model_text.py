"""Reads the text of a hand's file and the files that it names, within bounds, for MuJoCo.

MuJoCo's compiler reads any file that a model names. Here the model's files are read first, only
from its own folder and up to a size, and handed over in memory; the text that is compiled names
nothing on disk. Elements that read other models, run code or copy parts are refused.
"""

import importlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from grasp_core.errors import InputError

LARGEST_TEXT, LARGEST_FILES = 4 * 2**20, 64 * 2**20
"""Largest size of the text, and of all files that it names together [bytes]."""
MOST_FILES, MOST_ELEMENTS = 500, 20_000
REFUSED = (
    "include",
    "model",
    "plugin",
    "extension",
    "replicate",
    "composite",
    "flexcomp",
    "attach",
)
"""Elements that read other models, run code or make copies in any number."""
MOST_PIXELS = 4096
"""Largest value of the attributes that say how large pictures and fields of heights are."""
COUNTS = ("width", "height", "nrow", "ncol")
FOLDERS = {"meshdir", "texturedir", "assetdir", "strippath"}
"""Attributes that say where files are."""
NAMED = ("mesh", "texture", "hfield")
"""Elements that are called like their files where they have no name."""
PACKAGE = "package://"
"""What begins the names of files in URDF; the name of a package follows."""


@dataclass(frozen=True, slots=True)
class ModelText:
    """The text of a model that names no file on disk."""

    xml: str
    files: dict[str, bytes]
    """The files that it names, by the names in it."""


def model_text(path: Path) -> ModelText:
    """Read a model's text and the files that it names.

    Raises:
        InputError: The file cannot be read, is no XML, holds what is refused, or names files that
            are missing, too large, or outside its folder.
    """
    raw = _bytes(path, LARGEST_TEXT, path)
    if b"<!DOCTYPE" in raw or b"<!ENTITY" in raw:
        raise InputError(f"{path}: a hand's file must not declare entities; remove <!DOCTYPE ...>")
    etree: Any = importlib.import_module("xml.etree.ElementTree")
    try:
        root = etree.fromstring(raw)
    except etree.ParseError as error:
        raise InputError(
            f"{path}: expected an MJCF or URDF file, but it is no XML: {error}"
        ) from error
    elements = list(root.iter())
    if root.tag not in {"mujoco", "robot"} or len(elements) > MOST_ELEMENTS:
        raise InputError(
            f"{path}: expected <mujoco> or <robot> with at most {MOST_ELEMENTS} elements, got "
            f"<{str(root.tag)[:40]}> with {len(elements)}"
        )
    for element in elements:
        _check_element(path, element)
    return ModelText(*_with_files(path, root, elements, etree))


def _check_element(path: Path, element: Any) -> None:
    """Refuse an element that reads, runs or makes what the file does not hold.

    Raises:
        InputError: It does.
    """
    if element.tag in REFUSED:
        raise InputError(
            f"{path}: <{element.tag}> is not read in a hand's file; write out what it stands for"
        )
    if element.tag == "size":  # how much memory MuJoCo takes
        element.attrib.clear()
    for key in COUNTS:
        if len(element.get(key, "0")) > len(str(MOST_PIXELS)):
            raise InputError(
                f"{path}: {key} of <{element.tag}> must be at most {MOST_PIXELS}, got "
                f"{element.get(key)[:40]}"
            )


def _with_files(
    path: Path, root: Any, elements: list[Any], etree: Any
) -> tuple[str, dict[str, bytes]]:
    """Read the files that elements name, and give them names of their own."""
    places = [path.parent, *_places(path, elements)]
    files, names, left = dict[str, bytes](), dict[str, str](), LARGEST_FILES
    for element in elements:
        for key in [key for key in element.attrib if key.startswith("file")]:
            given = element.attrib[key]
            if given not in names:
                found = _found(path, given, places)
                content = _bytes(found, left, path)
                left -= len(content)
                names[given] = f"file{len(names)}{found.suffix.lower()}"
                files[names[given]] = content
            if len(names) > MOST_FILES:
                raise InputError(f"{path}: names more than {MOST_FILES} files")
            if element.tag in NAMED and root.tag == "mujoco":  # unnamed ones are called so
                element.attrib.setdefault("name", Path(given).stem)
            element.attrib[key] = names[given]
    return etree.tostring(root, encoding="unicode"), files


def _places(path: Path, elements: list[Any]) -> list[Path]:
    """Return the folders in which the model says that its files are, and forget them there."""
    found = list[Path]()
    for element in elements:
        if element.tag == "compiler":
            for key in FOLDERS & set(element.attrib):
                value = element.attrib.pop(key)
                if key != "strippath":
                    found.append(path.parent / value)
    return found


def _found(path: Path, given: str, places: list[Path]) -> Path:
    """Find a named file in the folder of the model.

    Raises:
        InputError: It is missing or outside that folder.
    """
    home, name = path.parent.resolve(), given
    if given.startswith(PACKAGE):
        name = given[len(PACKAGE) :].partition("/")[2]
    tried = [place / name for place in places] + [place / Path(name).name for place in places]
    for each in tried:
        try:
            whole = each.resolve()
            if whole.is_relative_to(home) and whole.is_file():
                return whole
        except (OSError, ValueError, RuntimeError):
            continue
    raise InputError(
        f"{path}: names the file {given[:80]!r}, which is not in the folder of the model; put it "
        "there"
    )


def _bytes(path: Path, most: int, model: Path) -> bytes:
    """Read a file of a size up to `most`.

    Raises:
        InputError: It cannot be read, or is larger.
    """
    try:
        with path.open("rb") as file:
            content = file.read(most + 1)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from error
    if len(content) > most:
        raise InputError(
            f"{path}: a hand's text may have {LARGEST_TEXT >> 20} MiB and its files "
            f"{LARGEST_FILES >> 20} MiB together; {model.name} exceeds that"
        )
    return content
