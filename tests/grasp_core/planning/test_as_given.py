"""Names of faces and halves on the object as it was given."""

from dataclasses import replace

from grasp_core.objects.standard_order import standard
from grasp_core.planning.as_given import _place, faces_as_given
from scenes.example_objects import example_object


def test_halves_are_named_in_order_also_where_only_the_last_face_has_any():
    on = standard(example_object("box"))
    for halved in (5, 2):
        here = replace(on, faces=(3, 5, 0, 1, 2, 4), owners=(0, 1, 2, 3, 4, 5, halved, halved))
        given = here.faces[halved]
        assert [_place(here, face) for face in range(6)] == [(face, "") for face in here.faces]
        assert [_place(here, face) for face in (6, 7)] == [(given, "a"), (given, "b")]
        assert faces_as_given((0, 1, 6, 7), here) == tuple(sorted((3, 5, given, given)))
