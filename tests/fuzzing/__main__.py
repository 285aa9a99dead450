"""Fuzz readers: `python -m tests.fuzzing READER ... --minutes 5`, or `all`; needs atheris.

Inputs that do harm are made small and put into `tests/fuzzing/corpus/READER/`, which the tests
read from then on. The exit code is 1 if there are any.
"""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

from tests.fuzzing.running import fuzz, keep_finds
from tests.fuzzing.targets import targets

MEMORY = Path("/dev/shm")  # noqa: S108 - a folder in memory, where there is one
GRACE_S = 900
"""For imports and the last input, on a busy machine."""


def main() -> int:
    """Fuzz each reader in a process of its own, one after another."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("readers", nargs="+", metavar="READER", help="`all`, or some by name")
    parser.add_argument("--minutes", type=float, default=5.0, help="for each reader")
    parser.add_argument("--in-folder", type=Path, help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.in_folder is not None:  # before anything of ours is imported, to be instrumented
        fuzz(asked.readers[0], round(60 * asked.minutes), asked.in_folder)
    known = targets()
    names = list(known) if asked.readers == ["all"] else asked.readers
    if unknown := [name for name in names if name not in known]:
        parser.error(f"no reader {unknown[0]}; there are {', '.join(known)}")
    return int(any([_found(name, asked.minutes) for name in names]))


def _found(name: str, minutes: float) -> bool:
    """Whether fuzzing found anything."""
    with tempfile.TemporaryDirectory(dir=MEMORY if MEMORY.is_dir() else None) as folder:
        work = Path(folder)
        command = [sys.executable, "-m", "tests.fuzzing", name, "--minutes", str(minutes)]
        log = work / "log"
        with log.open("wb") as stream:
            ended = subprocess.run(
                [*command, "--in-folder", folder], stdout=stream, stderr=stream, check=False,
                timeout=60 * minutes + GRACE_S,
            )  # fmt: skip
        said = log.read_text(errors="replace")
        kept = keep_finds(targets()[name], work)
        facts = [line for line in said.splitlines() if line.startswith(("stat::", f"{name}: "))]
        counts = (work / "counts").read_text().split() if (work / "counts").exists() else ["?"] * 2
        print(f"{name}: exit {ended.returncode}, {counts[0]} inputs, {counts[1]} accepted")
        print("\n".join(f"  {line}" for line in facts))
        if ended.returncode and not kept:
            print(said[-2000:])
        for path in kept:
            print(f"  kept {path}")
        return bool(kept or ended.returncode)


if __name__ == "__main__":
    sys.exit(main())
