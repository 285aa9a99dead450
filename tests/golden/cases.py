"""What the net holds: commands, each case in a folder of its own, and the files that they write.

A case is a list of command lines; `>` at its end names a file for what a command prints. Commands
that exist in one tree only are not here, so that two trees can be compared.
"""

import shlex
from dataclasses import dataclass

OBJECTS = (
    "tetrahedron", "octahedron", "box", "wedge", "prism", "hexagonal-pyramid", "l-bracket", "mug",
    "random-9-7", "random-14-7",
)  # fmt: skip


@dataclass(frozen=True)
class Case:
    """Commands that run one after the other in one folder."""

    name: str
    lines: tuple[str, ...]

    @property
    def commands(self):
        """Arguments of each command, and the name of the file for its output, or None."""
        for line in self.lines:
            command, _, file = line.partition(" > ")
            yield shlex.split(command), file or None


# A box whose face at +x has moved outwards by 2 mm, for `transfer`.
CHANGED_BOX = """\
v -0.05 -0.035 -0.025
v 0.052 -0.035 -0.025
v 0.052 0.035 -0.025
v -0.05 0.035 -0.025
v -0.05 -0.035 0.025
v 0.052 -0.035 0.025
v 0.052 0.035 0.025
v -0.05 0.035 0.025
f 4 3 2 1
f 5 6 7 8
f 1 2 6 5
f 2 3 7 6
f 3 4 8 7
f 4 1 5 8
"""

CONTACTS = """\
{"friction": 0.5, "contacts": [
 {"position_m": [0.05, 0.0, 0.0], "normal": [-1.0, 0.0, 0.0]},
 {"position_m": [-0.05, 0.01, 0.0], "normal": [1.0, 0.0, 0.0]},
 {"position_m": [0.0, 0.035, 0.01], "normal": [0.0, -1.0, 0.0]},
 {"position_m": [0.0, -0.035, -0.01], "normal": [0.0, 1.0, 0.0], "friction": 0.4}]}
"""

GIVEN = {"changed.obj": CHANGED_BOX, "contacts.json": CONTACTS}
"""Files that lie in each folder before its commands run."""


def _planned_and_validated(name):
    friction = 0.3 if name == "octahedron" else 0.5
    return Case(
        name,
        (
            f"plan {name} --limit 20 --friction {friction} --jobs 1 --out .",
            "validate grasps.json --limit 2 --jobs 1 --out .",
        ),
    )


CASES = (
    Case(
        "hand",
        (
            "plan box --limit 2 --jobs 1 --out .",
            "reach grasps.json --hand leap --table-down 0 0 -1 --limit 1 --simulate --jobs 1"
            " --out .",
            "reach grasps.json --hand leap --mass-kg 0.05 --torque-limit-n-m 0.7 --limit 1"
            " --jobs 1 --out executed",
        ),
    ),
    Case(
        "dataset",
        (
            "dataset build wedge --limit 1 --random-wrenches 2 --limits ramp --friction-below 1"
            " --friction-near 1 --moved-out 1 --figures closure --scenes --jobs 1 --out ds",
        ),
    ),
    Case("executed", ("run box --limit 2 --execute --jobs 1 --out .",)),
    Case(
        "executed-bracket",
        (
            "plan l-bracket --limit 2 --jobs 1 --out .",
            "execute grasps.json --mass-kg 0.3 --push-n 3 --trials lift,knock,misplaced --jobs 1"
            " --out .",
        ),
    ),
    Case(
        "proofs",
        (
            "plan octahedron --limit 2 --jobs 1 --out .",
            "regions grasps.json --limit 1 --recenter --jobs 1 --out .",
            "plan tetrahedron --best --gap 0.4 --limit 1 --optimize --jobs 1 --out best",
        ),
    ),
    Case(
        "judged",
        (
            "plan box --limit 2 --jobs 1 --out .",
            "validate grasps.json --limit 1 --protocol dexgraspbench --protocol mj-grasp-sim"
            " --jobs 1 --out .",
            "transfer grasps.json changed.obj --out carried",
            "analyze contacts.json --wrench 0 0 -3 0 0 0 --json > analysis.json",
            "export grasps.json --to gltf -o grasps.glb",
        ),
    ),
    Case(
        "scenes",
        (
            "plan l-bracket --limit 2 --jobs 1 --out .",
            "scene grasps.json --out own",
            "scene grasps.json --surface pads --out pads",
            "plan wedge --limit 1 --jobs 1 --out wedge",
            "scene wedge/grasps.json --torsion-m 0.003 --out wedge/soft",
            "scene grasps.json --mass-kg 0.3 --out held",
            "plan mug --limit 1 --jobs 1 --out curved",
            "scene curved/grasps.json --mass-kg 0.3 --out curved/held",
        ),
    ),
    Case(
        "noise",
        (
            "plan wedge --limit 1 --jobs 1 --out .",
            "validate grasps.json --repeats 5 --noise.shift 0.02 --noise.friction 0.1 --limits ramp"
            " --random-wrenches 2 --weight-n 2 --torsion-m 0.002 --traces --jobs 1"
            " --out .",
            "baseline record grasps.json -o wedge.baseline.json --limit 1 --jobs 1",
        ),
    ),
    *map(_planned_and_validated, OBJECTS),
)
