"""Calls that compile inner loops: what they leave, and when commands make them."""

import re
from pathlib import Path

import pytest

from grasp_core.compiled import copy_of
from sim_validate.kit import compiling
from sim_validate.kit.exit_codes import Exit
from sim_validate.main import main
from sim_validate.planning import plan as plan_command

ROOT = Path(__file__).parents[3]
SELDOM = {"many_chains", "deepest", "tip_point"}
"""Small loops for fingertips in an object and for many poses, which few commands need."""


def loops_that_are_not_kept():
    """Names of declared loops whose code lies nowhere; those called once lie in their callers'."""
    for path in sorted(ROOT.glob("*/**/*_kernel.py")):
        module = ".".join(path.relative_to(ROOT).with_suffix("").parts)
        if module.startswith(("grasp_core", "scenes")):
            copy = copy_of(module, str(path))
            files = copy.parent.parent.glob(f"{copy.parent.name}*/**/{copy.stem}.*.nbi")
            kept = {file.name.removeprefix(f"{copy.stem}.").split("-")[0] for file in files}
            declared = re.findall(r"^@loop\((.*)\)\ndef (\w+)", path.read_text(), re.MULTILINE)
            yield from {name for how, name in declared if "once=True" not in how} - kept


@pytest.mark.slow
def test_all_loops_are_kept_once_all_are_compiled():
    compiling.compile_loops(compiling.EVERYTHING)
    assert set(loops_that_are_not_kept()) <= SELDOM
    assert not compiling.must_compile(compiling.EVERYTHING, jobs=2)


@pytest.mark.parametrize("jobs", [1, 2])
def test_calls_are_made_in_two_processes_or_in_one(jobs, tmp_path):
    """Each call leaves a file; some may fail, and the rest is done all the same."""
    calls = ((tmp_path / "one").touch, broken, (tmp_path / "two").touch)
    compiling.compile_loops(compiling.Loops((), calls), jobs)
    assert {path.name for path in tmp_path.iterdir()} == {"one", "two"}


def broken():
    raise ValueError("no such loop")


@pytest.mark.parametrize(("kept", "jobs", "said"), [(False, 2, 1), (True, 2, 0), (False, 1, 0)])
def test_a_plan_compiles_first_what_is_not_kept_if_two_processes_may(
    kept, jobs, said, tmp_path, capsys, monkeypatch
):
    made = []
    monkeypatch.setattr(compiling, "is_kept", lambda _: kept)
    monkeypatch.setattr(plan_command, "compile_loops", made.append)
    words = ["plan", "tetrahedron", "--limit", "1", "--jobs", str(jobs), "--out", str(tmp_path)]
    assert main(words) == Exit.GOOD
    assert made == said * [compiling.PLANNING]
    assert capsys.readouterr().out.count("compiling inner loops once") == said
