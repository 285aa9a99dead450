"""Time against what a user would otherwise run: `python -m tests.benchmarks [--json]`."""

import json
import sys

from tests.benchmarks import metrics


def main():
    rows = metrics.rows()
    if "--json" in sys.argv[1:]:
        print(json.dumps(rows, indent=1))
        return
    print(f"{'what':44s} {'median us':>10s} {'mean us':>10s} {'ratio':>7s}  accuracy")
    for row in rows:
        ratio = f"{row['ratio']:.1f}x" if row["ratio"] else ""
        print(
            f"{row['what']:44s} {row['median_us']:10.0f} {row['mean_us']:10.0f} {ratio:>7s}"
            f"  {row['accuracy']}"
        )


if __name__ == "__main__":
    main()
