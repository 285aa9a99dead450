"""Loading ends on long and thin shapes however they lie."""

import numpy as np
import pytest

import grasp_core as gc
from tests.grasp_core.curved import inside, met
from tests.grasp_core.long_shapes import lying

ROUNDING = 1e-9


@pytest.mark.timeout(120)  # neither ended once
@pytest.mark.parametrize(
    ("name", "kind", "faces"), [("rod", "auto", 20), ("square bar", "patches", 6)]
)
def test_a_long_shape_that_lies_anyhow_is_loaded(name, kind, faces):
    body = _load(*lying(name, 1), kind)
    assert len(body.faces) == faces
    assert body.patches == gc.PatchLimits()


@pytest.mark.timeout(120)  # none ended once
@pytest.mark.parametrize("name", ["rod", "test tube", "bar with holes"])
def test_over_each_point_of_a_long_patch_is_one_point_of_the_surface(name):
    body, rng = _load(*lying(name, 1), "patches"), np.random.default_rng(0)
    for face in body.faces:
        for point in inside(face.polygon, rng, 30):
            heights, inward = met(body, face, point)
            np.testing.assert_allclose(heights, heights[:1], atol=1e-7 * body.radius)
            assert np.abs(heights).max() <= face.depth + ROUNDING * body.radius
            assert np.arccos(np.minimum(inward @ face.normal, 1.0)).max() <= face.spread + 1e-7


def _load(vertices, triangles, kind):
    return gc.Polyhedron.from_mesh(vertices, triangles, faces=kind)
