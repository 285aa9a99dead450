"""Try out all bad input: `python -m tests.bad_input [GROUP ...]`; exits with 1 if any fails."""

import sys
from collections import defaultdict

from tests.bad_input.catalogue import all_cases
from tests.bad_input.judging import complaints
from tests.bad_input.trying import Trials, Tried


def main() -> int:
    """Try every case of the groups that are named, or of all, and print what they cost."""
    costs, failed = defaultdict[str, list[Tried]](list), 0
    with Trials() as trials:
        for case in all_cases():
            if sys.argv[1:] and case.group not in sys.argv[1:]:
                continue
            tried = trials.tried(case)
            costs[case.group].append(tried)
            if wrong := complaints(case, tried):
                failed += 1
                print(f"{case.group}: {case.name}: {'; '.join(wrong)}\n    {tried.message[:600]}")
    print("group                 cases  refused  most seconds  most MB")
    for group, tried in costs.items():
        refused = sum(each.code != 0 for each in tried)
        seconds, space = (max(getattr(each, n) for each in tried) for n in ("seconds", "megabytes"))
        print(f"{group:21} {len(tried):5} {refused:8} {seconds:13.2f} {space:8.0f}")
    print(f"{sum(map(len, costs.values()))} cases, {failed} not as promised")
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
