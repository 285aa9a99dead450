"""The command `analyze` on a file."""

import json
from pathlib import Path

import pytest

from sim_validate.main import main


@pytest.fixture
def analyze(tmp_path, monkeypatch, capsys):
    """The exit code and the one document of `analyze --json` on a file with this content."""
    monkeypatch.chdir(tmp_path)

    def run(content, *flags):
        Path("contacts.json").write_text(json.dumps(content))
        code = main(["analyze", "contacts.json", "--json", *flags])
        return code, json.loads(capsys.readouterr().out)

    return run
