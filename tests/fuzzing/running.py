"""One reader under atheris, in a process of its own; what it finds is kept, each find once."""

import random
import re
import sys
import traceback
from hashlib import sha256
from pathlib import Path

from tests.fuzzing.changing import MOST_BYTES, changed
from tests.fuzzing.minimising import minimised
from tests.fuzzing.targets import CORPUS, FoundError, Target, targets

SECONDS_EACH, MEGABYTES = 10, 2048
"""For one input."""
AFRESH = 0.5
"""How often a file that is read is changed, and not what became of one: most others are refused."""
COUNTED = 100
"""Inputs after which counts are told."""
LARGEST_KEPT = 2**16
"""Bytes of an input that is kept in the repository."""
FIRST_WORDS = 5
OURS = ("grasp_core", "scenes", "sim_validate")
COMPILED = ["grasp_core.compiled"]
"""Modules that numba compiles, which cannot be instrumented."""


def signature(error: BaseException) -> str:
    """What kind of find it is: the error, and the last place in our code or the first words."""
    if isinstance(error, FoundError):
        return "-".join(re.findall("[a-z]+", str(error))[:FIRST_WORDS])
    frames = [f for f in traceback.extract_tb(error.__traceback__) if "/tests/" not in f.filename]
    ours = [frame for frame in frames if any(f"/{name}/" in frame.filename for name in OURS)]
    place = (ours or frames or [None])[-1]
    where = "reading" if place is None else f"{Path(place.filename).stem}-{place.name}"
    return f"{type(error).__name__}-{where}".replace("<", "").replace(">", "")


def harm(target: Target, data: bytes) -> str | None:
    """The signature of what an input does that it must not; None if it does nothing."""
    try:
        target.check(data)
    except Exception as error:  # whatever a reader raises is what we are after
        return signature(error)
    return None


def keep(target: Target, data: bytes, name: str) -> Path:
    """Put an input where the tests read it."""
    folder = CORPUS / target.name
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}-{sha256(data).hexdigest()[:8]}"
    path.write_bytes(data)
    return path


def fuzz(name: str, seconds: int, work: Path) -> None:
    """Fuzz one reader; does not return.

    Args:
        name: Of the reader.
        seconds: To go on for.
        work: Folder for inputs that reach new code, and for those that hang or crash.
    """
    import atheris

    with atheris.instrument_imports(include=list(OURS), exclude=COMPILED):
        target = targets()[name]
        seeds = list(target.inputs())
        for _, data in seeds:
            harm(target, data)  # what is imported when a file is read
    seen: set[str] = set()
    counts = {"inputs": 0, "accepted": 0}

    def one(data: bytes) -> None:
        counts["inputs"] += 1
        try:
            counts["accepted"] += target.check(data)
        except Exception as error:
            kind = signature(error)
            if kind not in seen:
                seen.add(kind)
                (work / "finds").mkdir(exist_ok=True)
                (work / "finds" / kind).write_bytes(data)
                print(f"{name}: found {kind}: {error!s:.300}", file=sys.stderr, flush=True)
        if counts["inputs"] % COUNTED == 0:
            (work / "counts").write_text(f"{counts['inputs']} {counts['accepted']}")

    def custom(data: bytes, most: int, seed: int) -> bytes:
        rng = random.Random(seed)  # noqa: S311 - nothing is secret
        beginning = rng.choice(seeds)[1] if rng.random() < AFRESH else data
        return changed(target.written, beginning, rng, atheris.Mutate)[:most]

    corpus = work / "corpus"
    corpus.mkdir(exist_ok=True)
    for i, (_, data) in enumerate(seeds):
        (corpus / f"seed{i}").write_bytes(data)
    arguments = [
        sys.argv[0], str(corpus), f"-max_total_time={seconds}", f"-timeout={SECONDS_EACH}",
        f"-rss_limit_mb={MEGABYTES}", f"-max_len={MOST_BYTES}", f"-artifact_prefix={work}/harm-",
        "-print_final_stats=1", "-verbosity=1",
    ]  # fmt: skip
    atheris.Setup(arguments, one, custom_mutator=custom)
    atheris.Fuzz()


def keep_finds(target: Target, work: Path) -> list[Path]:
    """Make what was found small and keep it; what hangs or crashes is kept as it is."""
    kept: list[Path] = []
    for path in sorted((work / "finds").glob("*")):
        data, kind = path.read_bytes(), path.name
        least = minimised(data, lambda less, kind=kind: harm(target, less) == kind)
        kept.append(keep(target, least, kind))
    for path in sorted(work.glob("harm-*")):
        data = path.read_bytes()
        if len(data) <= LARGEST_KEPT:
            kept.append(keep(target, data, path.name.split("-")[1]))
    return kept
