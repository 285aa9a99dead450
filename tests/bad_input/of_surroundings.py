"""Group 8: surroundings in which a program wakes up and cannot do what it is asked."""

from functools import partial
from pathlib import Path

from tests.bad_input.cases import Case, flag_case
from tests.bad_input.good_files import good

GROUP = "surroundings"


def _grasps(line: str, folder: Path) -> list[str]:
    (folder / "grasps.json").write_bytes(good("grasps.json"))
    (folder / "taken").write_text("mine")
    (folder / "full").mkdir()
    (folder / "full" / "mine.txt").write_text("mine")
    return line.split()


ON_GRASPS = {
    "validate grasps.json --out taken": "taken",
    "validate grasps.json --out taken/deeper": "taken",
    "validate grasps.json --out /proc/nowhere": "/proc/nowhere",
    "scene grasps.json --out taken": "taken",
    "report full": "full",
    "report taken": "taken",
    "report nowhere": "nowhere",
    "view grasps.json --grasp nobody --picture a.png": "nobody",
    "replay grasps.json --grasp nobody --out made": "verdicts.json",
    "replay full --out made": "full",
    "dataset verify full": "full",
    "dataset verify nowhere": "nowhere",
    "dataset export full --out made": "full",
    "dataset build tetrahedron --out full": "full",
    "dataset build nobody.stl --frictions 0.5 --out made": "nobody.stl",
    "baseline check nowhere.json": "nowhere.json",
    "baseline record grasps.json -o taken": "taken",
    "regions grasps.json --grasp nobody": "nobody",
    "plan tetrahedrron": "tetrahedron",
    "plan ../nowhere/part.obj": "part.obj",
    "plan random-3-1": "random",
    "inspect http://localhost/part.obj": "part.obj",
}
WORDS = {
    "NUMBA_NUM_THREADS=0": ("plan tetrahedron --limit 1", "NUMBA_|unset"),
}


def cases() -> list[Case]:
    """All of the group."""
    found = [
        Case(GROUP, line, partial(_grasps, line), 4, (says,)) for line, says in ON_GRASPS.items()
    ]
    line = "view grasps.json --picture a.docx"
    found.append(Case(GROUP, line, partial(_grasps, line), 2, ("--picture", "a.docx")))
    for said, (line, says) in WORDS.items():
        name, value = said.split("=")
        case = flag_case(GROUP, line, says, 4)
        found.append(Case(GROUP, said, case.make, 4, case.says, ((name, value),)))
    return found
