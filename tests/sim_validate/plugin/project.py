"""A project of somebody else's, with a baseline of two grasps, as tests of the plugin need it."""

import contextlib
import io
import os
import subprocess
import sys
import warnings
from pathlib import Path
from xml.etree import ElementTree

import pytest


def run_pytest(folder, *arguments):
    """Run pytest inside this process, which spares its start; its exit code and what it printed."""
    said = io.StringIO()
    left_out = ("cacheprovider", "faulthandler", "hypothesispytest", "unraisableexception",
                "threadexception")  # fmt: skip
    line = [word for name in left_out for word in ("-p", f"no:{name}")]
    with pytest.MonkeyPatch.context() as patched, contextlib.redirect_stdout(said):
        for name in [name for name in os.environ if "PYTEST" in name]:
            patched.delenv(name)
        patched.setenv("COLUMNS", "80")
        patched.syspath_prepend(folder)
        patched.chdir(folder)
        with contextlib.redirect_stderr(said), warnings.catch_warnings():
            warnings.resetwarnings()  # errors in our tests are warnings in those of others
            code = pytest.main([*line, *arguments])
    for name, module in list(sys.modules.items()):  # the next project has files of the same names
        file = getattr(module, "__file__", None)
        if file and Path(file).is_relative_to(folder):
            del sys.modules[name]
    return code, said.getvalue()


def run_pytest_alone(folder, *arguments):
    """Run pytest as a user would, in a process of its own; its exit code and what it printed."""
    line = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", *arguments]
    plain = {name: value for name, value in os.environ.items() if "PYTEST" not in name}
    ran = subprocess.run(
        line, cwd=folder, env=plain, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False
    )
    return ran.returncode, ran.stdout.decode()


def properties_in(junit):
    """The properties of each test, by name, of a file that `--junitxml` has written."""
    return [
        {each.get("name"): each.get("value") for each in case.iter("property")}
        for case in ElementTree.parse(junit).getroot().iter("testcase")  # noqa: S314 - ours
    ]


def copied(project, folder):
    for path in project.iterdir():
        if path.is_file():
            (folder / path.name).write_bytes(path.read_bytes())
