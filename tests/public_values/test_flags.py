"""Numbers in flags have the bounds of the functions that they go to."""

import os
import subprocess
import sys

import pytest

from grasp_core.checked import LARGEST_FRICTION, MOST_EDGES, MOST_SEED
from sim_validate.cli.exit_codes import Exit
from sim_validate.main import main

RUN = "from sim_validate.main import run_and_exit; run_and_exit()"
FRICTIONS = ["0", "-1", "nan", "inf", "1e9", "1e-300", "1e300", f"{LARGEST_FRICTION + 1.0}"]
WITH_FRICTION = [
    ["plan", "tetrahedron"], ["run", "tetrahedron"], ["validate", "no.json"], ["scene", "no.json"],
    ["execute", "no.json"], ["regions", "no.json"], ["view", "no.json"],
    ["dataset", "build", "tetrahedron", "--out", "no"],
]  # fmt: skip
OTHERS = [
    ["analyze", "no.json", "--friction", "-1"],
    ["analyze", "no.json", "--friction", "1e9"],
    ["plan", "tetrahedron", "--seed", "-1"],
    ["plan", "tetrahedron", "--seed", f"{MOST_SEED + 1}"],
    ["plan", "tetrahedron", "--limit", "0"],
    ["plan", "tetrahedron", "--limit", "2.5"],
    ["plan", "tetrahedron", "--limit", f"{10**30}"],
    ["plan", "tetrahedron", "--max-face-parts", "-1"],
    ["plan", "tetrahedron", "--theta-deg", "nan"],
    ["plan", "tetrahedron", "--edge-clearance-m", "inf"],
    ["plan", "tetrahedron", "--share-faces-m", "-1"],
    ["plan", "tetrahedron", "--approach-m", "0"],
    ["analyze", "no.json", "--edges", f"{MOST_EDGES + 1}"],
    ["analyze", "no.json", "--torque-scale-m", "1e-300"],
    ["analyze", "no.json", "--max-normal-force", "1e300"],
    ["run", "tetrahedron", "--fingertip-mass-kg", "0"],
    ["run", "tetrahedron", "--fingertip-mass-kg", "1e-12"],
    ["run", "tetrahedron", "--fingertip-mass-kg", "1e12"],
    ["run", "tetrahedron", "--fingertip-radius-m", "0"],
    ["run", "tetrahedron", "--trials", "-1"],
    ["run", "tetrahedron", "--timeout-s", "nan"],
    ["run", "tetrahedron", "--mass-kg", "0"],
    ["scene", "no.json", "--density-kg-m3", "-1"],
    ["export", "no.json", "--to", "gltf", "-o", "a.glb", "--limit", "0"],
    ["export", "no.json", "--to", "gltf", "-o", "a.glb", "--fingertip-radius-m", "0"],
    ["execute", "no.json", "--seed", f"{MOST_SEED + 1}"],
    ["execute", "no.json", "--misplacements", "1001"],
    ["execute", "no.json", "--off-deg", "nan"],
    *(
        ["execute", "no.json", f"--{name}", value]
        for name in (
            "mass-kg",
            "density-kg-m3",
            "push-n",
            "tip-stiffness-n-per-m",
            "tip-radius-m",
            "lift-m",
            "tip-mass-kg",
            "damping-ratio",
            "lift-s",
            "shake-g",
            "shake-hz",
            "stop-m-per-s2",
            "stop-from-m-per-s",
            "knock-n-s",
            "off-mm",
            "off-deg",
            "max-mm",
            "max-deg",
        )
        for value in ("-1", "1e300")
    ),
]


@pytest.mark.parametrize("friction", FRICTIONS)
@pytest.mark.parametrize("command", WITH_FRICTION, ids=" ".join)
def test_a_friction_that_no_material_has_is_refused_by_every_command(
    command, friction, capsys, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    assert main([*command, f"--friction={friction}"]) == Exit.USAGE
    said = capsys.readouterr()
    assert "friction" in said.err
    assert "Traceback" not in said.err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("command", OTHERS, ids=" ".join)
def test_a_number_out_of_range_is_refused_with_the_name_of_its_flag(
    command, capsys, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    assert main(["=".join(command[-2:]) if word == command[-2] else word
                 for word in command[:-1]]) == Exit.USAGE  # fmt: skip
    said = capsys.readouterr()
    assert command[-2] in said.err
    assert "Traceback" not in said.err
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_a_command_says_which_settings_numba_refuses(tmp_path):
    words = [sys.executable, "-c", RUN, "plan", "tetrahedron"]
    done = subprocess.run(
        words, env={**os.environ, "NUMBA_NUM_THREADS": "0"}, cwd=tmp_path, capture_output=True,
        text=True, check=False,
    )  # fmt: skip
    assert done.returncode == Exit.INPUT
    assert "NUMBA_" in done.stderr
    assert "Traceback" not in done.stderr
