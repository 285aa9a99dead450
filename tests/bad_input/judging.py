"""What is expected of every refusal, and whether it came."""

from tests.bad_input.cases import Case
from tests.bad_input.trying import Tried

SECONDS, MEGABYTES = 10.0, 2048.0
LINES, LETTERS = 24, 2000
"""Of one screen."""
USAGE = 2


def complaints(case: Case, tried: Tried) -> list[str]:
    """What is wrong with an answer; nothing if all is as promised."""
    said = tried.message
    wrong = {
        f"exit code {tried.code}, expected {case.code}": tried.code != case.code,
        "a traceback": "Traceback" in tried.err or "internal error" in tried.err,
        f"took {tried.seconds:.1f} s": tried.seconds > SECONDS,
        f"took {tried.megabytes:.0f} MB": tried.megabytes > MEGABYTES,
        f"left {tried.left[:3]}": bool(tried.left),
        "control characters": any(not c.isprintable() and c != "\n" for c in tried.err),
    }
    if case.code:
        wrong |= {
            "no message": not said,
            "more than a screen": len(tried.err.splitlines()) > LINES or len(tried.err) > LETTERS,
            "results beside a refusal": bool(tried.out) and case.code != USAGE,
            "no name of the program": case.code != USAGE and "graspproof: " not in said,
        }
    missing = [word for word in case.says if word.lower() not in said.lower()]
    return [name for name, holds in wrong.items() if holds] + [
        f"does not say {w!r}" for w in missing
    ]
