import ast
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent.parent
PACKAGES = ("grasp_core", "scenes", "sim_validate")


def stub(package):
    """The imports of a package's stub, each a module, a name and the same name.

    A stub declares nothing else, except for the version of the project.
    """
    body = ast.parse((ROOT / package / "__init__.pyi").read_text()).body
    imports = [each for each in body if isinstance(each, ast.ImportFrom)]
    others = [ast.unparse(each) for each in body if not isinstance(each, ast.ImportFrom)]
    assert others == (["__version__: str"] if package == "grasp_core" else [])
    assert imports
    assert all(len(each.names) == 1 for each in imports)
    return [(each.module, each.names[0].name, each.names[0].asname) for each in imports]


@pytest.mark.parametrize("package", PACKAGES)
def test_what_a_type_checker_sees_is_what_there_is(package):
    module = import_module(package)
    for home, name, shown in stub(package):
        assert name == shown
        assert home.startswith(f"{package}.")
        assert getattr(module, name) is getattr(import_module(home), name)
    names = sorted(name for _, name, _ in stub(package))
    assert dir(module) == names == sorted(set(names))
    everything = {}
    exec(f"from {package} import *", everything)  # noqa: S102
    assert set(names) <= set(everything)


@pytest.mark.parametrize("package", PACKAGES)
def test_a_wrong_name_is_an_attribute_error(package):
    with pytest.raises(AttributeError, match=f"module '{package}' has no attribute 'grasps_of'"):
        _ = import_module(package).grasps_of
    with pytest.raises(ImportError, match="grasps_of"):
        exec(f"from {package} import grasps_of", {})  # noqa: S102


def test_modules_of_a_package_are_imported_as_ever():
    code = "from grasp_core import plan; from grasp_core.solvers import lp; "
    code += "import grasp_core.optimizing.best_grasp as qc; "
    code += "import grasp_core as gc; print(lp.__name__, gc.quality_ceiling is qc.quality_ceiling)"
    answer = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert answer.stdout.split() == ["grasp_core.solvers.lp", "True"], answer.stderr
