"""Files that a model names are found near it, and nowhere else."""

import numpy as np
import pytest

import scenes
from grasp_core.errors import InputError
from tests.scenes.hand_files.grippers import gripper, loaded, written
from tests.scenes.hand_files.test_published_kinds import TIPS, meshed, robot
from tests.scenes.meshes import box_obj

SITES = ("s0", "s1", "s2", "s3")
CYLINDER = 'type="cylinder" size="0.05 0.005"'
PALM = gripper().replace(CYLINDER, 'type="mesh" mesh="palm"')
ASSET = '<asset><mesh file="palm.obj"/></asset>'
WHOLE = gripper()
BODIES = WHOLE[WHOLE.index("<worldbody>") + 11 : WHOLE.index("</worldbody>")]


def palm_of(path):
    return sorted(scenes.hand_from_file(path, SITES).palm[0].half_sizes)


def box_at(path):
    written(path.parent, box_obj(0.01, 0.02, 0.03), path.name)


def including(*files, more=""):
    """The gripper's palm as a mesh, with other files included at the top."""
    own = "".join(f'<include file="{file}"/>' for file in files)
    return PALM.replace("</mujoco>", f"{own}{more}</mujoco>")


@pytest.mark.parametrize("name", ["../meshes/middle.obj", "../../hand/meshes/middle.obj"])
def test_shapes_lie_in_folders_beside_that_of_the_model(name, tmp_path):
    written(tmp_path / "hand" / "meshes", box_obj(0.005, 0.005, 0.005), "middle.obj")
    hand = loaded(tmp_path / "hand" / "urdf", robot(middle=meshed(name)), TIPS)
    assert hand.links[1].shapes[0].half_sizes == pytest.approx([0.005] * 3)


@pytest.mark.parametrize("key", ["meshdir", "assetdir"])
def test_a_stated_folder_is_relative_to_the_model(key, tmp_path):
    box_at(tmp_path / "assets" / "palm.obj")
    text = including(more=f'<compiler {key}="../assets/"/>{ASSET}')
    assert palm_of(written(tmp_path / "xml", text)) == pytest.approx([0.01, 0.02, 0.03], abs=1e-6)


UPWARDS = {
    "from above": ("mjcf", "./mjcf/meshes/", "mjcf/meshes"),
    "beside": ("mjcf/hand", "../../../bundle/hand/assets", "mjcf/assets"),
    "beside, with more parts": ("mjcf/hand", "../../../bundle/other/assets", "mjcf/other/assets"),
    "far above in a package": ("package/a/b/c", "meshes", "package/meshes"),
    "of another machine": ("mjcf", "/home/someone/hand/meshes", "mjcf/meshes"),
}


@pytest.mark.parametrize("case", UPWARDS)
def test_a_stated_folder_is_looked_for_above_the_model_and_by_its_last_parts(case, tmp_path):
    home, stated, place = UPWARDS[case]
    written(tmp_path / "package", "<package/>", "package.xml")
    box_at(tmp_path / place / "palm.obj")
    text = including(more=f'<compiler meshdir="{stated}"/>{ASSET}')
    path = written(tmp_path / home, text)
    assert palm_of(path) == pytest.approx([0.01, 0.02, 0.03], abs=1e-6)


def test_a_file_is_taken_from_where_it_is_stated_first_and_then_by_most_parts(tmp_path):
    places = ("xml/far/meshes", "xml/meshes", "xml")
    text = including(more=f'<compiler meshdir="far/meshes"/>{ASSET}')
    path = written(tmp_path / "xml", text)
    for n, place in enumerate(reversed(places)):
        size = 0.01 * (n + 1)
        written(tmp_path / place, box_obj(size, size, size), "palm.obj")
        assert palm_of(path) == pytest.approx([size] * 3, abs=1e-6)


def test_names_that_are_made_up_are_those_of_no_file(tmp_path):
    box_at(tmp_path / "file1.obj")
    written(tmp_path, box_obj(0.04, 0.04, 0.04), "a b.obj")
    files = '<asset><mesh name="palm" file="file1.obj"/><mesh file="a b.obj"/></asset>'
    assert palm_of(written(tmp_path, including(more=files))) == pytest.approx(
        [0.01, 0.02, 0.03], abs=1e-6
    )


def test_a_manifest_opens_the_whole_package(tmp_path):
    written(tmp_path / "hand", box_obj(0.005, 0.005, 0.005), "middle.obj")
    text = robot(middle=meshed("../../middle.obj"))
    with pytest.raises(InputError, match=r"put it there, or a package\.xml"):
        loaded(tmp_path / "hand" / "models" / "urdf", text, TIPS)
    written(tmp_path / "hand", "<package/>", "package.xml")
    hand = loaded(tmp_path / "hand" / "models" / "urdf", text, TIPS)
    assert hand.links[1].shapes[0].half_sizes == pytest.approx([0.005] * 3)


CLOSED = {
    "above": "../secret.obj",
    "far above": "../../other/secret.obj",
    "hidden": "../.keys/secret.obj",
    "another kind": "../keys/id_rsa",
    "absolute": "{root}/hand/secret.obj",
    "link": "../keys/link.obj",
}


@pytest.mark.parametrize("case", CLOSED)
def test_nothing_else_is_read(case, tmp_path):
    for folder in ("hand", "other", "hand/.keys", "hand/keys", "hand/urdf"):
        box_at(tmp_path / folder / "secret.obj")
    box_at(tmp_path / "hand" / "keys" / "id_rsa")
    (tmp_path / "hand" / "keys" / "link.obj").symlink_to(tmp_path / "other" / "secret.obj")
    (tmp_path / "hand" / "urdf" / "secret.obj").unlink()
    name = CLOSED[case].format(root=tmp_path)
    with pytest.raises(InputError, match="nor in one beside it"):
        loaded(tmp_path / "hand" / "urdf", robot(middle=meshed(name)), TIPS)


@pytest.mark.parametrize("home", ["hand", "hand/someone"])
def test_nothing_beside_the_model_is_read_in_a_home_folder(home, tmp_path, monkeypatch):
    box_at(tmp_path / "hand" / "meshes" / "middle.obj")
    text = robot(middle=meshed("../meshes/middle.obj"))
    assert loaded(tmp_path / "hand" / "urdf", text, TIPS)
    monkeypatch.setenv("HOME", str(tmp_path / home))
    with pytest.raises(InputError, match="nor in one beside it"):
        loaded(tmp_path / "hand" / "urdf", text, TIPS)


def test_included_files_are_read_with_their_settings_and_files(tmp_path):
    """They name others in the folder of the model or in their own, and may state folders."""
    box_at(tmp_path / "assets" / "palm.obj")
    written(tmp_path / "xml" / "parts", '<mujoco><include file="deep/b.xml"/></mujoco>', "a.xml")
    inner = f'<x><compiler assetdir="../assets"/>{ASSET}<include file="parts/c.xml"/></x>'
    written(tmp_path / "xml" / "parts" / "deep", inner, "b.xml")
    written(tmp_path / "xml" / "parts", "<x><option timestep='0.003'/></x>", "c.xml")
    path = written(tmp_path / "xml", including("parts/a.xml"))
    assert palm_of(path) == pytest.approx([0.01, 0.02, 0.03], abs=1e-6)


def test_bodies_are_included_where_they_are_named(tmp_path):
    written(tmp_path / "common", f"<mujocoinclude>{BODIES}</mujocoinclude>", "bodies.xml")
    text = '<mujoco><worldbody><include file="../common/bodies.xml"/></worldbody></mujoco>'
    found = scenes.hand_from_file(written(tmp_path / "xml", text), SITES)
    assert found == scenes.hand_from_file(written(tmp_path / "whole", WHOLE), SITES)


def test_a_mesh_beside_an_included_file_is_found(tmp_path):
    box_at(tmp_path / "parts" / "palm.obj")
    written(tmp_path / "parts", f"<mujocoinclude>{ASSET}</mujocoinclude>", "assets.xml")
    path = written(tmp_path, including("parts/assets.xml"))
    assert palm_of(path) == pytest.approx([0.01, 0.02, 0.03], abs=1e-6)


REFUSED = {
    "itself": (["gripper.xml"], "once more"),
    "twice": (["a.xml", "a.xml"], "once more"),
    "in a circle": (["b.xml"], "once more"),
    "missing, called alike": (["../../far/gripper.xml"], "not in the folder"),
    "missing": (["none.xml"], "<include>: names the file 'none.xml', which is not in the folder"),
    "no name": ([""], "<include>: names the file ''"),
    "outside": (["../../secret.xml"], "not in the folder"),
    "absolute": (["/etc/passwd"], "not in the folder"),
    "no xml": (["text.xml"], "no XML"),
    "entities": (["bomb.xml"], "entities"),
    "too large": (["large.xml"], "4 MiB"),
    "attaching": (["attach.xml"], "<attach> is not read"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_includes_that_are_not_read_are_refused(case, tmp_path):
    files, said = REFUSED[case]
    folder = tmp_path / "hand" / "xml"
    for name, text in {
        "a.xml": "<x><option/></x>", "b.xml": '<x><include file="c.xml"/></x>',
        "c.xml": '<x><include file="b.xml"/></x>', "text.xml": "hello",
        "bomb.xml": '<!DOCTYPE a [<!ENTITY b "c">]><x/>', "large.xml": " " * 2**22,
        "attach.xml": '<x><worldbody><attach model="a"/></worldbody></x>',
    }.items():  # fmt: skip
        written(folder, text, name)
    written(tmp_path, "<x/>", "secret.xml")
    text = including(*files).replace('type="mesh" mesh="palm"', CYLINDER)
    with pytest.raises(InputError, match=said):
        scenes.hand_from_file(written(folder, text), SITES)


def test_urdf_has_no_includes(tmp_path):
    with pytest.raises(InputError, match="<include> is not read"):
        loaded(tmp_path, robot(more='<include file="a.xml"/>'), TIPS)


def test_stated_folders_alone_open_nothing(tmp_path):
    box_at(tmp_path / "other" / "palm.obj")
    text = including(more=f'<compiler meshdir="{tmp_path / "other"}"/>{ASSET}')
    with pytest.raises(InputError, match="not in the folder"):
        scenes.hand_from_file(written(tmp_path / "deep" / "xml", text), SITES)
    assert np.isfinite(palm_of(written(tmp_path / "xml", text))).all()
