"""The size of the house: lines and modules, each of which may fall and hardly ever rise.

    python -m tests.house

The command fails where a total is above that of the table. Imports, layers and circles are
contracts in `pyproject.toml`, which `lint-imports` checks.
"""

import sys
from pathlib import Path

ROOT = Path(__file__).parent.parent
PACKAGES = ("grasp_core", "scenes", "sim_validate")
TOTALS = {
    "lines of packages": 67_963,
    "modules of packages": 351,
    "lines of tests": 47_146,
    "lines of docs": 4_758,
}
"""Most that there may be. Who merges lowers a number to what the command prints. A number rises
only with a line below that says why."""
RISES = (
    "lines of packages, 65,865 to 67,963, modules, 338 to 351: hands throughout: joints that follow"
    " others and tendons in every simulation, datasets with any hand, what stops a hand, and Isaac"
    " grasp files of hands",
    "lines of tests, 45,633 to 47,146: a test for each of these, beside MuJoCo's own model of a"
    " hand's file, chains moved by hand, and readers written from a published format",
    "lines of docs, 4,262 to 4,758: a page about a hand of one's own, columns about hands, reasons"
    " that stop one",
    "lines of packages, 61,173 to 65,865, modules, 304 to 338: recorded grasps are judged, in six"
    " formats, with hands as their files have them, objects of convex pieces, a trial of the whole"
    " hand, pages and checks of what is written",
    "lines of tests, 41,548 to 45,633: a test for each of these, beside MuJoCo's own kinematics,"
    " closed forms and hostile files",
    "lines of docs, 3,986 to 4,262: a page and a notebook about recorded grasps, and their fields",
    "lines of packages, 60,554 to 61,173, modules, 300 to 304: gates that are kept, samples"
    " simulated in one call, maps bounded side by side, runs again in two lengths of steps,"
    " processor time by kind of work, and published tests imported where they are asked for",
    "lines of tests, 40,892 to 41,548: these beside what they replace, bit for bit or by proof,"
    " and executions beside short steps throughout",
    "lines of docs, 3,981 to 3,986: kept gates, time with -v, and which executions are run again",
    "modules, 263 to 300: modules of several subjects are divided, and each is named for what it"
    " holds",
    "lines of packages, 59,544 to 60,562, modules, 248 to 263: 3MF, schemas of"
    " files, locks and time limits for every system, bytecode where Python must not write it,"
    " MuJoCo 3.17, and declarations by pydantic, which split six modules into ten",
    "lines of tests, 39,856 to 41,086: a test for each of these",
    "lines of docs, 3,954 to 3,998: systems, versions of MuJoCo, 3MF and schemas",
    "lines of packages, 57,054 to 57,106: linear programs whose rows nearly coincide",
    "lines of packages, 57,116 to 57,123: names of modules that say more are longer",
    "lines of packages, 57,123 to 57,146, modules, 239 to 240: proofs of absence have a module",
    "lines of packages, 57,146 to 57,150: workers of Ray run at the niceness of the build",
    "lines of packages, 57,150 to 57,757, modules, 240 to 242: a proved chance of closure where"
    " the object, the fingers and friction are off",
    "lines of packages, 57,757 to 57,764: a flatness as wide as the object",
    "lines of packages, 57,764 to 59,544, modules, 242 to 247: searches that end in time with"
    " what is found, tiny parts, parts that touch, voids, limits that are attained, hands as"
    " published, soft fingertips in analyses, one list of the kinds of files, grasps that fail"
    " alone",
    "lines of tests, 37,965 to 39,856: a test for each of these faults",
    "lines of docs, 3,904 to 3,954: what is new in files, flags and meshes",
    "lines of docs, 3,896 to 3,904: the same chance, and how well it was measured to hold",
    "lines of tests, 37,927 to 37,965: forged landings, rounded faces, and harmless errors",
    "lines of tests, 37,739 to 37,931: branches of proofs and their checks that no test took",
    "lines of docs, 3,784 to 3,896: sentences that are understood without their neighbours",
    "lines of packages, 57,106 to 57,116: a folder that is gone, and how far contacts may move",
)
"""Sentences such as "lines of tests, 50,000 to 50,400: the oracle of a new theorem"."""


def lines_of(paths):
    """How many lines some files have."""
    return sum(len(path.read_text(encoding="utf-8").splitlines()) for path in paths)


def measured():
    """Every total, by name."""
    modules = [path for package in PACKAGES for path in (ROOT / package).rglob("*.py")]
    return {
        "lines of packages": lines_of(modules),
        "modules of packages": len(modules),
        "lines of tests": lines_of((ROOT / "tests").rglob("*.py")),
        "lines of docs": lines_of((ROOT / "docs").glob("*.md")),
    }


def main():
    """Print the totals; 1 if one is above its number."""
    found = measured()
    for name, count in found.items():
        most = TOTALS[name]
        print(f"{name}: {count:,} (at most {most:,})")
        if count > most:
            print(f"    {count - most:,} too many: shorten something, or raise the number in "
                  "tests/house.py and say there in RISES why")  # fmt: skip
        elif count < most:
            print(f"    TOTALS of tests/house.py can be lowered to {count}")
    return int(any(count > TOTALS[name] for name, count in found.items()))


if __name__ == "__main__":
    sys.exit(main())
