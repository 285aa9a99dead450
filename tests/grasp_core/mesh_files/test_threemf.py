"""A 3MF file gives the object that the same triangles give in another format."""

import re

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

import grasp_core as gc
from grasp_core.errors import MeshRefusal
from grasp_core.mesh_files.reading import mesh_of_bytes
from grasp_core.objects.polyhedron import UNITS_M
from tests.bad_input.mesh_texts import obj, turned
from tests.bad_input.of_threemf import PRODUCTION, components, item, mesh, model, object_, threemf
from tests.fuzzing.mesh_files import same_triangles, triangles_of

SIZE_M = np.array([0.0762, 0.0508, 0.0254])
"""Three by two by one inch."""
UNITS = {"micron": "um", "millimeter": "mm", "centimeter": "cm", "meter": "m", "inch": "in",
         "foot": "ft"}  # fmt: skip
NUMBER = st.floats(-2.0, 2.0).filter(lambda x: abs(x) > 1e-3)


def box(extents, unit=1.0, low=(0.0, 0.0, 0.0)):
    made = trimesh.creation.box(extents=extents)
    return ((made.vertices - made.bounds[0] + low) / unit).tolist(), made.faces.tolist()


def body_of(folder, data, name="part.3mf", **lengths):
    (folder / name).write_bytes(data if isinstance(data, bytes) else data.encode())
    return gc.load_polyhedron(folder / name, **lengths)


def like(one, other):
    """The faces, the volume and the centre of mass are the same, to rounding."""
    assert len(one.faces) == len(other.faces)
    assert len(one.vertices) == len(other.vertices)
    assert one.volume == pytest.approx(other.volume, rel=1e-9)
    np.testing.assert_allclose(one.center_of_mass, other.center_of_mass, atol=1e-12)
    normals = [sorted(map(tuple, np.round(each.normals, 9) + 0.0)) for each in (one, other)]
    np.testing.assert_allclose(*normals, atol=1e-9)


@pytest.mark.parametrize("unit", UNITS)
def test_the_unit_that_a_file_states_is_its_unit_whether_it_is_given_or_not(unit, tmp_path):
    points, faces = box(SIZE_M, UNITS_M[UNITS[unit]])
    data = threemf(model(object_(mesh(points, faces)), more=f'unit="{unit}"'))
    as_obj = body_of(tmp_path, obj(*box(SIZE_M, 1e-3)), "part.obj", unit="mm")
    like(body_of(tmp_path, data), as_obj)
    like(body_of(tmp_path, data, unit=UNITS[unit]), as_obj)
    assert body_of(tmp_path, data, scale=2.0).volume == pytest.approx(8.0 * as_obj.volume)
    for other in UNITS_M.keys() - {UNITS[unit]}:
        with pytest.raises(gc.MeshError, match=rf"part\.3mf.*\({UNITS[unit]}\), got {other};"):
            body_of(tmp_path, data, unit=other)


def test_a_file_that_states_no_unit_is_in_millimetres(tmp_path):
    data = threemf(model(object_(mesh(*box(SIZE_M, 1e-3))), more=""))
    assert body_of(tmp_path, data).volume == pytest.approx(SIZE_M.prod(), rel=1e-9)


@settings(max_examples=30)
@given(st.lists(NUMBER, min_size=24, max_size=24))
def test_items_and_components_are_placed_turned_stretched_and_mirrored(numbers):
    poses = [" ".join(map(repr, each)) for each in (numbers[:12], numbers[12:])]
    objects = object_(components(2, 2, more=f'transform="{poses[0]}"')) + object_(mesh(), 2)
    data = threemf(model(objects, item(1, poses[1]) + item(2, poses[0])))
    found = triangles_of("3mf", data)
    assert len(found[1]) == 12
    same_triangles("3mf", data, found)


def test_a_part_of_two_components_is_the_same_as_its_surface(tmp_path):
    """Boxes that touch are united, and their walls in one plane are one face."""
    long, high = box((0.04, 0.02, 0.02)), box((0.02, 0.02, 0.06))
    objects = object_(mesh(*long), 7) + object_(mesh(*high), 3)
    both = '<component objectid="7" transform="0 1 0 -1 0 0 0 0 1 .02 0 0"/>'
    both += '<component objectid="3" transform="1 0 0 0 1 0 0 0 1 0 .04 0"/>'
    objects = object_(f"<components>{both}</components>", 9) + objects
    body = body_of(tmp_path, threemf(model(objects, item(9))))
    (low, faces), (post, _) = box((0.02, 0.04, 0.02)), box((0.02, 0.02, 0.06), low=(0, 0.04, 0))
    as_obj = obj(low + post, faces + [[i + 8 for i in each] for each in faces])
    like(body, body_of(tmp_path, as_obj, "part.obj"))
    assert len(body.faces) == 8
    assert body.center_of_mass == pytest.approx([0.01, 0.038, 0.022])


def test_two_items_of_one_part_number_are_both_built():
    twice = "".join(
        f'<item objectid="1" partnumber="A" transform="1 0 0 0 1 0 0 0 1 {x} 0 0"/>' for x in (0, 9)
    )
    points, triangles = triangles_of("3mf", threemf(model(items=twice)))
    assert len(triangles) == 8
    assert np.ptp(points[:, 0]) == pytest.approx(9.1)


def test_a_cavity_and_a_mirrored_box_are_taken_as_in_other_formats(tmp_path):
    outer, inner = box((0.1, 0.1, 0.1)), box((0.02, 0.02, 0.02), low=(0.04, 0.04, 0.04))
    walls = object_(mesh(*outer)) + object_(mesh(inner[0], turned(inner[1])), 2)
    hollow = outer[1] + [[i + 8 for i in each] for each in turned(inner[1])]
    as_obj = body_of(tmp_path, obj(outer[0] + inner[0], hollow), "part.obj")
    like(body_of(tmp_path, threemf(model(walls, item() + item(2)))), as_obj)
    mirror = threemf(model(object_(mesh(*outer)), item(1, "-1 0 0 0 1 0 0 0 1 0 0 0")))
    body = body_of(tmp_path, mirror)
    assert body.surface.repairs == ()
    assert body.volume == pytest.approx(1e-3)


def test_open_surfaces_and_parts_apart_are_refused_as_in_other_formats(tmp_path):
    points, faces = box((0.1, 0.1, 0.1))
    whole, far = object_(mesh(points, faces)), item(1, "1 0 0 0 1 0 0 0 1 .3 0 0")
    for reason, said in {
        MeshRefusal.OPEN: model(object_(mesh(points, faces[:-4]))),
        MeshRefusal.SEPARATE: model(whole, item() + far),
    }.items():
        with pytest.raises(gc.MeshError) as caught:
            body_of(tmp_path, threemf(said))
        assert caught.value.reason is reason


@pytest.mark.parametrize(("pose", "times"), [("1 0 0 0 1 0 0 0 1 125 105 0.5", 1.0),
                                             (".6 .8 0 -.8 .6 0 0 0 1 1 2 3", 1.4)])  # fmt: skip
def test_the_rounding_of_an_object_is_that_of_its_numbers_times_its_pose(pose, times):
    """Far from the origin they have no fewer digits than they are written with."""
    ball = trimesh.creation.icosphere(2, 40.0)
    points = [[float(f"{x:.5g}") for x in point] for point in ball.vertices]
    as_obj = mesh_of_bytes("obj", obj(points, ball.faces).encode(), 10_000)
    assert as_obj.rounding == pytest.approx(0.5e-3, rel=0.01)
    data = threemf(model(object_(mesh(points, ball.faces)), item(1, pose)))
    found = mesh_of_bytes("3mf", data, 10_000)
    assert found.rounding == pytest.approx(times * as_obj.rounding)


WRITTEN_BY_TRIMESH = """<?xml version='1.0' encoding='utf-8'?>
<model xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02" \
xmlns:m="http://schemas.microsoft.com/3dmanufacturing/material/2015/02" \
xmlns:p="%s" unit="millimeter"><resources><object id="1" name="geometry_0" type="model" \
p:UUID="6f2e1c9a-0000-4000-8000-000000000001">%s</object></resources>\
<build p:UUID="6f2e1c9a-0000-4000-8000-000000000002"><item objectid="1" \
transform="1.0 0.0 0.0 0.0 1.0 0.0 0.0 0.0 1.0 0.0 0.0 0.0" \
p:UUID="6f2e1c9a-0000-4000-8000-000000000003" partnumber="geometry_0"/></build></model>"""


def test_what_trimesh_writes_is_read_exactly():
    ball = trimesh.creation.icosphere(2, 40.0)
    data = threemf(WRITTEN_BY_TRIMESH % (PRODUCTION, mesh(ball.vertices, ball.faces)))
    found = mesh_of_bytes("3mf", data, 10_000)
    assert found.unit == "mm"
    np.testing.assert_array_equal(found.vertices[found.triangles], ball.vertices[ball.faces])


def test_materials_triangle_sets_metadata_and_colours_are_passed_over():
    sets = '<t:trianglesets xmlns:t="http://schemas.microsoft.com/3dmanufacturing/trianglesets/2021/07"/>'
    colours = '<basematerials id="5"><base name="red" displaycolor="#FF0000"/></basematerials>'
    colours += '<m:colorgroup xmlns:m="urn:m" id="6"><m:color color="#00FF00"/></m:colorgroup>'
    group = '<metadatagroup><metadata name="a:b">hollow</metadata></metadatagroup>'
    coloured = mesh().replace("<triangle ", '<triangle pid="5" p1="0" ')
    inside = group + coloured.replace("</mesh>", f"{sets}</mesh>")
    rich = model(colours + object_(inside, more='pid="5" pindex="0" name="&lt;b&gt;"'))
    rich = rich.replace("<resources>", '<metadata name="Title">A</metadata><!-- no --><resources>')
    plain, found = (mesh_of_bytes("3mf", threemf(xml), 99) for xml in (None, rich))
    np.testing.assert_array_equal(found.vertices, plain.vertices)
    np.testing.assert_array_equal(found.triangles, plain.triangles)


def test_instances_are_counted_before_they_are_made():
    objects = (
        object_(mesh()) + object_(components(*[1] * 50), 2) + object_(components(*[2] * 50), 3)
    )
    with pytest.raises(gc.MeshError, match=re.escape("the limit is 9999")) as caught:
        mesh_of_bytes("3mf", threemf(model(objects, item(3))), 9_999)
    assert caught.value.reason is MeshRefusal.TOO_MANY
    assert len(mesh_of_bytes("3mf", threemf(model(objects, item(3))), 12_000).triangles) == 10_000
