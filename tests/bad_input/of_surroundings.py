"""Group 8: surroundings in which a program wakes up and cannot do what it is asked."""

from tests.bad_input.cases import Case
from tests.bad_input.good_files import good

FOLDER = {
    "grasps.json": lambda path: path.write_bytes(good("grasps.json")),
    "taken": "mine",
    "full/mine.txt": "mine",
}
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
CASES = [Case(line, line, says, files=FOLDER) for line, says in ON_GRASPS.items()]
CASES += [
    Case("a picture of no kind", "view grasps.json --picture a.docx", "--picture|a.docx", 2,
         FOLDER),
    Case("NUMBA_NUM_THREADS=0", "plan tetrahedron --limit 1", "NUMBA_|unset",
         environment={"NUMBA_NUM_THREADS": "0"}),
]  # fmt: skip
