"""What the search for covers finds is so, and it finds covers where there are some."""

import numpy as np
import pytest

import grasp_core as gc
import grasp_core.regions.growth as search
from grasp_core.closure.contacts import contact_frames
from grasp_core.regions.growth import Sites
from tests.judges import TETRA_NORMALS, random_rotation

CONES = 3_000


def sites_around(points, normals, *, radius=0.0, sides=0, depth=0.0, friction=0.5):
    k = len(points)
    turns = 2.0 * np.pi * np.arange(max(sides, 1)) / max(sides, 1)
    ring = (0.5 * radius if sides else 0.0) * np.column_stack([np.cos(turns), np.sin(turns)])
    return Sites(
        points, np.ascontiguousarray(contact_frames(normals)), np.full(k, friction),
        np.array([ring] * k), np.full(k, 0.5 * radius if sides else radius), np.full(k, depth),
    )  # fmt: skip


def corners_of(sites, i):
    """Corners of a polygon around a site, on both sides of its plane."""
    turns = 2.0 * np.pi * np.arange(64) / 64
    ring = sites.radii[i] / np.cos(np.pi / 64) * np.column_stack([np.cos(turns), np.sin(turns)])
    flat = (sites.corners[i][:, None] + ring).reshape(-1, 2) @ sites.frames[i][:, 1:].T
    off = sites.depths[i] * sites.frames[i][:, 0]
    return sites.points[i] + np.vstack([flat - off, flat + off])


def perturbed(seed):
    rng = np.random.default_rng(seed)
    turn = random_rotation(rng)
    normals = -TETRA_NORMALS + 0.15 * rng.normal(size=(4, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return (TETRA_NORMALS + 0.1 * rng.normal(size=(4, 3))) @ turn.T, normals @ turn.T


@pytest.mark.parametrize("seed", range(2))
def test_a_cover_that_is_found_passes_its_check(seed):
    sites = sites_around(*perturbed(seed), radius=0.1, depth=0.02)
    cover, _ = search.search_cover(sites, np.eye(6), CONES)
    smaller = sites._replace(radii=0.99 * sites.radii)  # corners are outside of the circle
    regions = [corners_of(smaller, i) for i in range(4)]
    assert cover.verify(regions, sites.frames[:, :, 0], sites.friction)
    larger = [2.0 * region - region.mean(axis=0) for region in regions]
    assert not cover.verify(larger, sites.frames[:, :, 0], sites.friction)


@pytest.mark.parametrize("seed", range(3))
def test_an_open_choice_is_open_and_in_the_sites(seed):
    points, normals = perturbed(seed)
    sites = sites_around(points, normals, radius=0.5)
    cover, choice = search.search_cover(sites, np.eye(6), CONES)
    assert cover is None
    assert not gc.force_closure(choice, normals, 0.5).closed
    away = choice - points
    assert (np.linalg.norm(away, axis=1) <= 0.5 + 1e-12).all()
    assert np.abs(np.einsum("ki,ki->k", away, normals)).max() < 1e-12


def test_open_contacts_are_never_covered():
    rng = np.random.default_rng(1)
    tried = 0
    for _ in range(60):
        points, normals = rng.normal(size=(4, 3)), rng.normal(size=(4, 3))
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        if gc.force_closure(points, normals, 0.5).closed:
            continue
        tried += 1
        assert search.search_cover(sites_around(points, normals), np.eye(6), 500)[0] is None
    assert tried > 40
