"""The page about a hand of one's own says what each of its steps prints."""

import re
import shlex
from itertools import zip_longest
from pathlib import Path

import pytest

from sim_validate.main import main
from tests.three_fingers import PAGE, coupled_fingers_mjcf

pytestmark = pytest.mark.slow
FENCED = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
RULE = re.compile(r"[ ─]*")
"""A line of a table that holds nothing, or the line below its heads."""


def words_of(text):
    """The lines of a text that say something, without spaces around columns."""
    lines = (" ".join(line.split()) for line in text.splitlines() if not RULE.fullmatch(line))
    return [line for line in lines if line]


def test_each_step_prints_what_the_page_shows(tmp_path, monkeypatch, capsys):
    """Pages leave out lines, for which `..` stands."""
    pytest.importorskip("pyarrow")
    monkeypatch.chdir(tmp_path)
    Path("three_fingers.xml").write_text(coupled_fingers_mjcf())
    steps, names, shown = FENCED.findall(PAGE.read_text()), {}, 0
    for (language, text), (other, below) in zip_longest(steps, steps[1:], fillvalue=("", "")):
        if language == "toml":
            Path("grasps.toml").write_text(text)
        elif language == "python":
            exec(text, names)  # noqa: S102 - it is what the page tells people to run
        elif language == "sh":
            for line in text.splitlines():
                words, _, code = line.partition("# exit code")
                assert main(shlex.split(words)[1:]) == int(code or 0), line
        else:
            continue
        if other == "text":
            shown += 1
            said = [line for stream in capsys.readouterr() for line in words_of(stream)]
            assert set(words_of(below)) - {".."} <= set(said), text
    assert shown == PAGE.read_text().count("```text")
