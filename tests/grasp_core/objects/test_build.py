import numpy as np
import pytest
from trimesh.triangles import mass_properties as judged

from grasp_core.objects.booleans import extrusion, hull
from grasp_core.objects.build import mass_properties


def test_another_implementation_agrees():
    rng = np.random.default_rng(0)
    whole = hull(rng.normal(size=(30, 3)))
    solid = whole - hull(0.3 * rng.normal(size=(8, 3))).moved([0.2, 0.0, 0.0])
    judge = judged(solid.vertices[solid.triangles], density=1.0)
    volume, center, inertia = mass_properties(solid)
    assert volume == pytest.approx(judge.volume, rel=1e-12)
    np.testing.assert_allclose(center, judge.center_mass, rtol=1e-12)
    np.testing.assert_allclose(inertia, judge.inertia, atol=1e-12 * np.trace(judge.inertia))


def test_inertia_about_a_stated_centre_grows_by_the_parallel_axis_theorem():
    solid = extrusion([[0, 0], [0.1, 0], [0.1, 0.2], [0, 0.2]], 0.3)
    center = np.array([0.09, 0.02, 0.28])
    volume, middle, uniform = mass_properties(solid)
    _, about, stated = mass_properties(solid, center)
    off = center - middle
    added = volume * (off @ off * np.eye(3) - np.outer(off, off))
    np.testing.assert_allclose(stated, uniform + added, rtol=1e-12)
    assert about.tolist() == center.tolist()
    assert np.linalg.eigvalsh(stated).min() > 0.0
