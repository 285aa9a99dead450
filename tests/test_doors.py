"""Each outside package is known to one module, and light imports stay light."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
DOORS = {
    "trimesh": "grasp_core/mesh.py",
    "manifold3d": "grasp_core/solids.py",
    "highspy": "grasp_core/lp.py",
    "numba": "grasp_core/kernels/",
    "clarabel": "grasp_core/conic.py",
    "qpsolvers": "grasp_core/forces.py",
    "scipy.optimize": "grasp_core/least_distance.py",
    "mujoco": "sim_validate/simulate.py",
    "pebble": "sim_validate/engines.py",
}


@pytest.mark.parametrize("package", DOORS)
def test_a_package_is_imported_at_its_door_only(package):
    pattern = re.compile(
        rf"^\s*(?:import|from)\s+{re.escape(package)}\b|import_module\(f?[\"']{package}\b",
        re.MULTILINE,
    )
    sources = [
        p for name in ("grasp_core", "scenes", "sim_validate") for p in (ROOT / name).rglob("*.py")
    ]
    assert len(sources) > 25
    users = {str(p.relative_to(ROOT)) for p in sources if pattern.search(p.read_text())}
    if package == "trimesh":
        pattern = re.compile(r"import_module\(f\"trimesh")
        users = {str(p.relative_to(ROOT)) for p in sources if pattern.search(p.read_text())}
    assert users
    assert all(user.startswith(DOORS[package]) for user in users)


@pytest.mark.parametrize(
    ("module", "heavy"),
    [
        (
            "grasp_core",
            ("mujoco", "trimesh", "scipy", "matplotlib", "highspy", "numba", "pydantic"),
        ),
        ("scenes", ("mujoco", "trimesh", "scipy", "matplotlib", "numba")),
        ("sim_validate.cli", ("mujoco", "trimesh", "scipy", "matplotlib", "numba")),
    ],
)
def test_importing_stays_light(module, heavy):
    code = f"import sys, {module}; print([m for m in {heavy!r} if m in sys.modules])"
    answer = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert answer.returncode == 0, answer.stderr
    assert answer.stdout.strip() == "[]"
