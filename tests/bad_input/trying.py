"""Commands tried out: each in a process of its own, what it says, costs and leaves behind.

Python and the packages are imported once, by a process that then forks for each command, so that
hundreds take minutes. Run as `python -m tests.bad_input.trying`, it takes a line of JSON for each
command, and answers with one.
"""

import atexit
import json
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from tests.bad_input.cases import Case

LONGEST_S = 200.0
"""After which a command is ended: it hangs, however busy the machine is."""
ADDRESS_SPACE = 16 * 2**30
"""Of a command, so that none takes the machine with it."""


@dataclass(frozen=True, slots=True)
class Tried:
    """What became of a command."""

    code: int
    out: str
    err: str
    seconds: float
    """Of a processor, spent by it and by the processes that it waited for."""
    megabytes: float
    left: tuple[str, ...]
    """Files that were not there before."""

    @property
    def message(self) -> str:
        """What it said on standard error, as one line without the borders of boxes."""
        return " ".join(self.err.translate(dict.fromkeys(map(ord, "│╭╰─╮╯"), " ")).split())


class Trials:
    """Tries commands one after another."""

    def __init__(self) -> None:
        root = Path(__file__).parents[2]
        self.server = subprocess.Popen(
            [sys.executable, "-P", "-m", "tests.bad_input.trying"], stdin=subprocess.PIPE,
            stdout=subprocess.PIPE, text=True, env={**os.environ, "PYTHONPATH": str(root)},
        )  # fmt: skip

    def __enter__(self) -> "Trials":
        return self

    def __exit__(self, *_: object) -> None:
        self.server.stdin.close()
        self.server.wait(30)
        self.server.stdout.close()

    def tried(self, case: Case) -> Tried:
        """Make a case's files and run its command."""
        with tempfile.TemporaryDirectory() as folder:
            argv = case.make(Path(folder))
            before = set(_files(Path(folder)))
            asked = {"argv": argv, "cwd": folder, "environment": dict(case.environment)}
            self.server.stdin.write(json.dumps(asked) + "\n")
            self.server.stdin.flush()
            said = json.loads(self.server.stdout.readline())
            left = sorted(set(_files(Path(folder))) - before)
        return Tried(**said, left=tuple(left))


def _files(folder: Path) -> list[str]:
    return [
        os.fsencode(path.relative_to(folder)).decode("utf-8", "replace")
        for path in folder.rglob("*")
        if not path.is_dir()
    ]


def serve() -> None:
    """Answer requests until there are no more."""
    import numpy.linalg

    import sim_validate.commands.plan
    import sim_validate.commands.validate
    import sim_validate.main  # noqa: F401 - for those that are forked

    del numpy
    for line in sys.stdin:
        asked = json.loads(line)
        with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
            child = os.fork()
            if child == 0:
                _run(asked, out.fileno(), err.fileno())
            code, used = _waited(child)
            said = {"code": code, "seconds": used.ru_utime + used.ru_stime,
                    "megabytes": used.ru_maxrss / 1024}  # fmt: skip
            for name, stream in (("out", out), ("err", err)):
                stream.seek(0)
                said[name] = stream.read().decode("utf-8", "replace")
        print(json.dumps(said), flush=True)


def _run(asked: dict, out: int, err: int) -> None:
    """In the forked process: the command, as the program would run it."""
    code = 70
    try:
        os.setsid()
        resource.setrlimit(resource.RLIMIT_AS, (ADDRESS_SPACE, ADDRESS_SPACE))
        os.chdir(asked["cwd"])
        os.environ.update(asked["environment"])
        nothing = os.open(os.devnull, os.O_RDONLY)
        for have, want in ((nothing, 0), (out, 1), (err, 2)):
            os.dup2(have, want)
        from sim_validate.main import main

        sys.argv = ["graspproof", *asked["argv"]]
        code = main(asked["argv"])
    except BaseException:
        import traceback

        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        atexit._run_exitfuncs()
        os._exit(code)


def _waited(child: int) -> tuple[int, resource.struct_rusage]:
    begun = time.monotonic()
    while True:
        ended, status, used = os.wait4(child, os.WNOHANG)
        if ended:
            return os.waitstatus_to_exitcode(status), used
        if time.monotonic() - begun > LONGEST_S:
            os.killpg(child, signal.SIGKILL)
        time.sleep(0.005)


if __name__ == "__main__":
    serve()
