"""Try out all bad input: `python -m tests.bad_input [GROUP ...]`; exits with 1 if any fails.

Prints the exit code of every case, so that two trees of the code can be compared.
"""

import sys

from tests.bad_input.cases import GROUPS, cases_of, tried

failed = count = 0
for group in sys.argv[1:] or GROUPS:
    for case in cases_of(group):
        code, message, wrong = tried(case)
        count, failed = count + 1, failed + bool(wrong)
        print(f"{group}: {case.name!r}: exit {code}", flush=True)
        if wrong:
            print(f"    {'; '.join(wrong)}\n    {message[:600]}")
print(f"{count} cases, {failed} not as promised")
sys.exit(int(failed > 0))
