"""Bad input as a catalogue: files, a command that reads them, and what must come of it."""

import contextlib
import io
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path

from sim_validate.main import main
from tests.bad_input.good_files import good
from tests.patience import HANGING_S

GROUPS = (
    "of_files", "of_obj", "of_binary_meshes", "of_threemf", "of_topology", "of_physics",
    "of_data_files", "of_surroundings",
)  # fmt: skip
"""Modules of cases; the last three make whole files first, which takes a while."""
COMMAND = [sys.executable, "-P", "-c", "from sim_validate.main import run_and_exit as r; r()"]
LINES, LETTERS = 24, 2000
"""Most lines and letters of a message: it must fit on one screen."""
USAGE = 2

Data = bytes | str | Callable[[Path], object]
"""What is in a file, or what makes it."""


@dataclass(frozen=True, slots=True)
class Case:
    """One bad file or value."""

    name: str
    line: str | list[str]
    """A command line; `good.json` in it is a whole file of grasps."""
    says: str = ""
    """In the message, parted by `|`: the file or flag, the field, the remedy."""
    code: int = 4
    """Exit code that docs/commands.md promises."""
    files: Mapping[str, Data] = field(default_factory=dict)
    environment: Mapping[str, str] = field(default_factory=dict)


def refused(name: str, file: str, data: Data, says: str = "", command: str = "inspect") -> Case:
    """A file that a command must refuse by name: in place of the word FILE, or as the last word."""
    words = [file if word == "FILE" else word for word in command.split()]
    words += [] if "FILE" in command.split() else [file]
    return Case(name, words, f"{file}|{says}", 4, {file: data})


def read(file: str, data: Data) -> Case:
    """A file that must be read."""
    return Case(f"read: {file}", ["inspect", file], "", 0, {file: data})


def cases_of(group: str) -> list[Case]:
    """Every case of a group."""
    return import_module(f"tests.bad_input.{group}").CASES


def tried(case: Case, *, apart: bool = False) -> tuple[int, str, list[str]]:
    """Run a case's command here, or in a process of its own.

    Returns:
        Its exit code, its message without line breaks and boxes, and what is wrong with them.
    """
    words = case.line.split() if isinstance(case.line, str) else case.line
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        for name, data in [*case.files.items(), *_whole(words)]:
            _write(Path(name), data)
        before = set(_files())
        run = _apart if apart or case.environment else _here
        code, out, err = run(case, words)
        left = sorted(set(_files()) - before)
    said = " ".join(err.translate(dict.fromkeys(map(ord, "│╭╰─╮╯"), " ")).split())
    wrong = {
        f"exit code {code}, expected {case.code}": code != case.code,
        "a traceback": "Traceback" in err or "internal error" in err,
        f"left {left[:3]}": bool(left),
        "control characters": any(not c.isprintable() and c != "\n" for c in err),
        "no message": case.code and not said,
        "more than a screen": case.code and (len(err.splitlines()) > LINES or len(err) > LETTERS),
        "results beside a refusal": case.code not in {0, USAGE} and out,
        "no name of the program": case.code not in {0, USAGE} and "graspproof: " not in said,
    } | {f"does not say {w!r}": w.lower() not in said.lower() for w in case.says.split("|")}
    return code, said, [name for name, holds in wrong.items() if holds]


def _whole(words: list[str]) -> Iterator[tuple[str, bytes]]:
    if "good.json" in words:
        yield "good.json", good("grasps.json")


def _write(path: Path, data: Data) -> None:
    path.parent.mkdir(exist_ok=True)
    if callable(data):
        data(path)
    else:
        path.write_bytes(data if isinstance(data, bytes) else data.encode())


def _files() -> list[str]:
    paths = (path for path in Path().rglob("*") if not path.is_dir())
    return [os.fsencode(path).decode("utf-8", "replace") for path in paths]


def _here(_: Case, words: list[str]) -> tuple[int, str, str]:
    out, err = (io.TextIOWrapper(io.BytesIO(), "utf-8", "replace") for _ in range(2))
    given, sys.argv = sys.argv, ["graspproof", *words]
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            code = main(words)
    finally:
        sys.argv = given
    for stream in (out, err):
        stream.seek(0)  # which writes what is held back
    return code, out.read(), err.read()


def _apart(case: Case, words: list[str]) -> tuple[int, str, str]:
    root = str(Path(__file__).parents[2])
    environment = {**os.environ, "PYTHONPATH": root, **case.environment}
    done = subprocess.run([*COMMAND, *words], env=environment, stdin=subprocess.DEVNULL,
                          capture_output=True, timeout=HANGING_S, check=False)  # fmt: skip
    out, err = (each.decode("utf-8", "replace") for each in (done.stdout, done.stderr))
    return done.returncode, out, err
