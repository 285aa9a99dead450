"""Fuzz readers: `python -m tests.fuzzing READER ... --minutes 5`, or `all`; needs atheris.

Inputs that do harm are put into `tests/fuzzing/corpus/READER/`, one of each kind, which the tests
read from then on. The exit code is 1 if there are any.
"""

import argparse
import random
import re
import subprocess
import sys
import tempfile
import traceback
from hashlib import sha256
from pathlib import Path

from tests.fuzzing.mutations import changed
from tests.fuzzing.targets import CORPUS, MEMORY, FoundError, targets

GRACE_S = 900
"""For imports and the last input, on a busy machine."""
LIMITS = ("-timeout=10", "-rss_limit_mb=2048", "-print_final_stats=1", "-verbosity=1")
"""Seconds and memory for one input, and what is told."""
MOST_BYTES = 2**18
"""Longer inputs are left to the tests of limits."""
AFRESH = 0.5
"""How often a file that is read is changed, and not what became of one: most others are refused."""
OURS = ("grasp_core", "scenes", "sim_validate")
COMPILED = ["grasp_core.compiled"]
"""Modules that numba compiles, which cannot be instrumented."""


def main() -> int:
    """Fuzz each reader in a process of its own, one after another."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("readers", nargs="+", metavar="READER", help="`all`, or some by name")
    parser.add_argument("--minutes", type=float, default=5.0, help="for each reader")
    parser.add_argument("--in-folder", type=Path, help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.in_folder is not None:  # before anything of ours is imported, to be instrumented
        fuzz(asked.readers[0], round(60 * asked.minutes), asked.in_folder)
    names = list(targets()) if asked.readers == ["all"] else asked.readers
    return int(any([_found(name, asked.minutes) for name in names]))


def _found(name: str, minutes: float) -> bool:
    """Whether fuzzing found anything, which is kept."""
    with tempfile.TemporaryDirectory(dir=MEMORY if MEMORY.is_dir() else None) as folder:
        command = [sys.executable, "-m", "tests.fuzzing", name, "--minutes", str(minutes)]
        ended = subprocess.run(
            [*command, "--in-folder", folder], stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
            text=True, errors="replace", check=False, timeout=60 * minutes + GRACE_S,
        )  # fmt: skip
        kept = [_kept(name, path) for path in sorted(Path(folder).glob("harm-*"))]
        print(ended.stdout[-2000:])
        print(f"{name}: exit {ended.returncode}, {len(kept)} inputs do harm")
        return bool(kept or ended.returncode)


def _kept(name: str, path: Path) -> Path:
    """Put an input where the tests read it."""
    data, kind = path.read_bytes(), path.name.split("-", 1)[1]
    folder = CORPUS / name
    folder.mkdir(parents=True, exist_ok=True)
    kept = folder / f"{kind[:60]}-{sha256(data).hexdigest()[:8]}"
    kept.write_bytes(data)
    print(f"  kept {kept}")
    return kept


def signature(error: BaseException) -> str:
    """What kind of find it is: the error, and the last place in our code or the first words."""
    if isinstance(error, FoundError):
        return "-".join(re.findall("[a-z]+", str(error))[:5])
    frames = traceback.extract_tb(error.__traceback__)
    ours = [frame for frame in frames if any(f"/{name}/" in frame.filename for name in OURS)]
    where = f"{Path(ours[-1].filename).stem}-{ours[-1].name}" if ours else "reading"
    return f"{type(error).__name__}-{where}".replace("<", "").replace(">", "")


def fuzz(name: str, seconds: int, work: Path) -> None:
    """Fuzz one reader for so long; does not return.

    Inputs that do harm, one of each kind, come into the folder, as do those that hang or crash.
    """
    import atheris

    seen, counts = set[str](), {"inputs": 0, "accepted": 0}

    def one(data: bytes) -> None:
        counts["inputs"] += 1
        try:
            counts["accepted"] += target.check(data)
        except Exception as error:  # whatever a reader raises is what we are after
            kind = signature(error)
            if kind not in seen:
                seen.add(kind)
                (work / f"harm-{kind}").write_bytes(data)
                print(f"{name}: found {kind}: {error!s:.300}", file=sys.stderr, flush=True)

    def custom(data: bytes, most: int, seed: int) -> bytes:
        rng = random.Random(seed)  # noqa: S311 - nothing is secret
        beginning = rng.choice(seeds) if rng.random() < AFRESH else data
        made = changed(target.written, beginning, rng)
        made = atheris.Mutate(beginning, MOST_BYTES) if made is None else made
        return made[: min(most, MOST_BYTES)]

    with atheris.instrument_imports(include=list(OURS), exclude=COMPILED):
        target = targets()[name]
        seeds = [data for _, data in target.inputs()]
        for data in seeds:
            one(data)  # what is imported when a file is read
    corpus = work / "corpus"
    corpus.mkdir()
    for i, data in enumerate(seeds):
        (corpus / f"seed{i}").write_bytes(data)
    arguments = [sys.argv[0], str(corpus), f"-max_total_time={seconds}", f"-max_len={MOST_BYTES}",
                 f"-artifact_prefix={work}/harm-", *LIMITS]  # fmt: skip
    atheris.Setup(arguments, one, custom_mutator=custom)
    atheris.Fuzz()


if __name__ == "__main__":
    sys.exit(main())
