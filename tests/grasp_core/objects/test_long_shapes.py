"""Loading ends on long and thin shapes however they lie."""

import numpy as np
import pytest

import grasp_core as gc
from tests.grasp_core.curved import check_patches
from tests.grasp_core.long_shapes import lying


@pytest.mark.timeout(120)  # neither ended once
@pytest.mark.parametrize(
    ("name", "kind", "faces"), [("rod", "auto", 20), ("square bar", "patches", 6)]
)
def test_a_long_shape_that_lies_anyhow_is_loaded(name, kind, faces):
    body = gc.Polyhedron.from_mesh(*lying(name), faces=kind)
    assert len(body.faces) == faces
    assert body.patches == gc.PatchLimits()


@pytest.mark.timeout(120)  # none ended once
@pytest.mark.parametrize("name", ["rod", pytest.param("bar with holes", marks=pytest.mark.slow)])
def test_over_each_point_of_a_long_patch_is_one_point_of_the_surface(name):
    body = gc.Polyhedron.from_mesh(*lying(name), faces="patches")
    check_patches(body, np.random.default_rng(0), 30, lean=1e-7)
