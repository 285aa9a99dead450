"""Try out all bad input: `python -m tests.bad_input [GROUP ...]`; exits with 1 if any fails.

Prints the exit code of every case, so that two trees of the code can be compared.
"""

import argparse
import sys

from tests.bad_input.cases import GROUPS, cases_of
from tests.bad_input.trying import complaints, tried

SECONDS, MEGABYTES = 10.0, 2048.0
"""Most that a case may take."""


def main() -> int:
    """Try every case of the groups that are named, or of all."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("groups", nargs="*", metavar="GROUP", help=", ".join(GROUPS))
    failed = count = 0
    for group in parser.parse_args().groups or GROUPS:
        for case in cases_of(group):
            found = tried(case)
            wrong = complaints(case, found)
            if found.seconds > SECONDS or found.megabytes > MEGABYTES:
                wrong.append(f"took {found.seconds:.1f} s, {found.megabytes:.0f} MB")
            count, failed = count + 1, failed + bool(wrong)
            print(f"{case.group}: {case.name!r}: exit {found.code}", flush=True)
            if wrong:
                print(f"    {'; '.join(wrong)}\n    {found.message[:600]}")
    print(f"{count} cases, {failed} not as promised")
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
