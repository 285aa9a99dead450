"""A command, again and again, in processes that are struck at one step on files after another.

    python -m tests.faults.everywhere kill|full EVERY FOLDER WORD...

`OUT` among the words is a folder of its own each time: `FOLDER/whole` undisturbed, `FOLDER/0` and
so on struck, each EVERY steps later than the one before. After a kill the same command runs once
more there, and what was there before that is in `FOLDER/0.struck`. Exit codes and messages are
printed as JSON; the last command met no such step.
"""

import errno
import json
import os
import shutil
import signal
import sys
from pathlib import Path

from sim_validate.main import main

STEPS = {"os.mkdir", "os.rename", "os.remove", "os.rmdir", "os.chmod"}
SYNC = "fsync"
WRITING = os.O_WRONLY | os.O_RDWR


def strike_at(step, kind, folder, tell):
    """End this process, or fail, at a step on files below a folder; removals do not fail."""
    counted = iter(range(10**6))

    def strike(event, details):
        opens = event == "open" and isinstance(details[2], int) and details[2] & WRITING
        if not (opens or event in STEPS or event == SYNC) or folder not in (
            path := Path(str(details[0])),
            *path.parents,
        ):
            return
        if kind != "kill" and event in {"os.remove", "os.rmdir"}:
            return
        if next(counted) == step:
            os.write(tell, b"struck")
            if kind == "kill":
                os.kill(os.getpid(), signal.SIGKILL)
            named = () if event == SYNC else (str(details[0]),)
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), *named)

    sys.addaudithook(strike)
    sync = os.fsync
    os.fsync = lambda handle: (strike(SYNC, [folder]), sync(handle))[1]


def forked(words, said, prepare):
    """Exit code of a command in a process of its own, negative where a signal ended it."""
    if (child := os.fork()) == 0:
        os.dup2(os.open(said, os.O_WRONLY | os.O_CREAT), 2)
        prepare()
        os._exit(main(words))
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def strikes(kind, every, folder, words):
    assert main([word.replace("OUT", str(folder / "whole")) for word in words]) == 0
    told, tell = os.pipe()
    os.set_blocking(told, False)
    for step in range(0, 1000, every):
        out, said = folder / str(step), folder / f"{step}.txt"
        own = [word.replace("OUT", str(out)) for word in words]
        if (given := folder / "given").is_dir():
            shutil.copytree(given, out)
        code = forked(own, said, lambda: strike_at(step, kind, out, tell))  # noqa: B023 - called at once
        if kind == "kill" and out.is_dir():
            shutil.copytree(out, folder / f"{step}.struck")
        yield code, said.read_text()
        try:
            os.read(told, 100)
        except BlockingIOError:
            return
        if kind != "kill":
            continue
        again = forked(own, folder / "again.txt", lambda: None)
        assert again == 0, (step, (folder / "again.txt").read_text())


if __name__ == "__main__":
    print(json.dumps(list(strikes(sys.argv[1], int(sys.argv[2]), Path(sys.argv[3]), sys.argv[4:]))))
