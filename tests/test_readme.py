"""What the README and the first page of docs/ show is what a reader gets."""

import re
import shlex
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import pytest

from sim_validate.main import main

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text()
START = (ROOT / "docs" / "start.md").read_text()
FENCED = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
PART = next(code for language, code in FENCED.findall(START) if language == "python")
"""The lines of Python that write the part of both pages."""


def test_the_example_prints_what_it_says():
    ((code, said),) = re.findall(r"```python\n(.*?)```.*?```text\n(.*?)```", README, re.DOTALL)
    answer = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert answer.returncode == 0, answer.stderr
    assert answer.stdout == said


@pytest.mark.parametrize(
    "page",
    [pytest.param(README, id="README", marks=pytest.mark.slow), pytest.param(START, id="start")],
)
def test_commands_print_what_pages_show_below_them(page, tmp_path, monkeypatch, capsys):
    """Pages leave out lines, for which `..` stands, and spaces around lines."""
    monkeypatch.chdir(tmp_path)
    exec(PART, {})  # noqa: S102 - it is what the page tells people to run
    found = FENCED.findall(page)
    shown = [(line, below) for (language, line), (other, below) in pairwise(found)
             if language == "sh" and other == "" and line.count("\n") == 1]  # fmt: skip
    assert shown
    for line, below in shown:
        words, _, code = line.partition("# exit code")
        assert main(shlex.split(words)[1:]) == int(code or 0), line
        lines = {each.strip() for said in capsys.readouterr() for each in said.splitlines()}
        assert {each.strip() for each in below.splitlines()} - {".."} <= lines
