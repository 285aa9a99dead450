"""A case tried out: what the command says, costs and leaves behind, and what is wrong with that."""

import contextlib
import io
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from sim_validate.main import main
from tests.bad_input.cases import Case
from tests.patience import HANGING_S

COMMAND = [sys.executable, "-P", "-c", "from sim_validate.main import run_and_exit as r; r()"]
LINES, LETTERS = 24, 2000
"""Most lines and letters of a message: it must fit on one screen."""
USAGE = 2


@dataclass(frozen=True, slots=True)
class Tried:
    """What became of a command."""

    code: int
    out: str
    err: str
    left: tuple[str, ...]
    """Files that were not there before."""
    seconds: float
    """Processor time that the command took."""
    megabytes: float
    """By which the largest memory of this process grew."""

    @property
    def message(self) -> str:
        """What it said on standard error, as one line without the borders of boxes."""
        return " ".join(self.err.translate(dict.fromkeys(map(ord, "│╭╰─╮╯"), " ")).split())


def tried(case: Case, *, apart: bool = False) -> Tried:
    """Make a case's files and run its command here, or apart, in a process of its own."""
    with tempfile.TemporaryDirectory() as folder, _working_in(folder):
        argv = case.make(Path(folder))
        before, begun, peak = set(_files(folder)), time.process_time(), _peak()
        run = _apart if apart or case.environment else _here
        code, out, err = run(case, argv)
        left = tuple(sorted(set(_files(folder)) - before))
        return Tried(code, out, err, left, time.process_time() - begun, _peak() - peak)


def _here(_: Case, argv: list[str]) -> tuple[int, str, str]:
    out, err = (io.TextIOWrapper(io.BytesIO(), "utf-8", "replace") for _ in range(2))
    given, sys.argv = sys.argv, ["graspproof", *argv]
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            code = main(argv)
    finally:
        sys.argv = given
    for stream in (out, err):
        stream.seek(0)  # which writes what is held back
    return code, out.read(), err.read()


def _apart(case: Case, argv: list[str]) -> tuple[int, str, str]:
    root = str(Path(__file__).parents[2])
    environment = {**os.environ, "PYTHONPATH": root, **dict(case.environment)}
    done = subprocess.run([*COMMAND, *argv], env=environment, stdin=subprocess.DEVNULL,
                          capture_output=True, timeout=HANGING_S, check=False)  # fmt: skip
    return done.returncode, *(
        each.decode("utf-8", "replace") for each in (done.stdout, done.stderr)
    )


@contextlib.contextmanager
def _working_in(folder: str) -> Iterator[None]:
    before = Path.cwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)


def _files(folder: str) -> list[str]:
    paths = (path for path in Path(folder).rglob("*") if not path.is_dir())
    return [os.fsencode(path).decode("utf-8", "replace") for path in paths]


def _peak() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def complaints(case: Case, found: Tried) -> list[str]:
    """What is wrong with an answer; nothing if all is as promised."""
    said = found.message
    wrong = {
        f"exit code {found.code}, expected {case.code}": found.code != case.code,
        "a traceback": "Traceback" in found.err or "internal error" in found.err,
        f"left {found.left[:3]}": bool(found.left),
        "control characters": any(not c.isprintable() and c != "\n" for c in found.err),
    }
    if case.code:
        wrong |= {
            "no message": not said,
            "more than a screen": len(found.err.splitlines()) > LINES or len(found.err) > LETTERS,
            "results beside a refusal": bool(found.out) and case.code != USAGE,
            "no name of the program": case.code != USAGE and "graspproof: " not in said,
        }
    missing = [word for word in case.says if word.lower() not in said.lower()]
    return [name for name, holds in wrong.items() if holds] + [
        f"does not say {w!r}" for w in missing
    ]
