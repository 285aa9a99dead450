"""Scenes for versions of MuJoCo that lack something, and versions that lack too much."""

import re
import runpy
import sys

import mujoco
import pytest

import grasp_core as gc
import scenes
from scenes import silent_mujoco
from scenes.mujoco import version_gaps

FLAG = ' speculative="disable"'


@pytest.fixture
def text_under(monkeypatch):
    """A function that writes a scene as under a version of MuJoCo."""
    body = scenes.example_object("wedge")
    grasp = gc.plan(body, 0.5, limit=1, settings=gc.PlanSettings(cones="normal")).grasps[0]

    def written(version):
        monkeypatch.setattr(version_gaps, "versions", lambda: {"mujoco": version})
        return scenes.build_scene(body, grasp, 0.5).xml

    return written


def test_a_flag_is_left_out_where_it_is_not_known_and_a_comment_says_so(text_under):
    newer, older = text_under("4.0.0"), text_under("3.17.0")
    note = r"\n *<!-- (Written for MuJoCo 3\.17\.0, which lacks the flag `speculative`.*) -->"
    assert "4.0" in re.search(note, older).group(1)
    assert FLAG in newer
    assert re.sub(note, "", older) == newer.replace(FLAG, "")


@pytest.mark.parametrize("version", ["4.0.1", "4.10.0", "5.0.0.dev1", "not installed"])
def test_versions_that_know_all_flags_get_the_same_text(text_under, version):
    assert text_under(version) == text_under("4.0.0")


def test_a_scene_written_for_an_older_version_is_the_same_model(text_under):
    one, other = (
        mujoco.MjModel.from_xml_string(text_under(version)).opt
        for version in ("3.17.0", mujoco.__version__)
    )
    assert (one.enableflags, one.disableflags) == (other.enableflags, other.disableflags)


def test_a_version_without_batches_is_refused_with_those_that_have_them(monkeypatch):
    monkeypatch.delattr(mujoco, "batch")
    monkeypatch.setitem(sys.modules, "mujoco.batch", None)
    with pytest.raises(gc.InputError, match=r"again, a version from 3\.17 to 4\.x"):
        runpy.run_path(silent_mujoco.__file__)
