import numpy as np
import pytest
from scipy.spatial import cKDTree

from grasp_core.objects.build import close_pairs
from grasp_core.objects.surface import components


def judged(count, links):
    """The least thing that each one reaches, by walking along links from the least one on."""
    neighbours = {each: set() for each in range(count)}
    for one, other in np.asarray(links).tolist():
        neighbours[one].add(other)
        neighbours[other].add(one)
    least = np.full(count, -1)
    for start in range(count):
        waiting = [start] if least[start] < 0 else []
        while waiting:
            here = waiting.pop()
            least[here] = start
            waiting += [each for each in neighbours[here] if least[each] < 0]
    return least


@pytest.mark.parametrize("seed", range(20))
def test_components_are_what_a_walk_along_the_links_reaches(seed):
    rng = np.random.default_rng(seed)
    links = rng.integers(0, 100, (int(rng.integers(0, 150)), 2))
    assert components(100, links).tolist() == judged(100, links).tolist()


def test_a_long_chain_in_any_order_is_one_component():
    for order in (np.arange(5000), np.random.default_rng(0).permutation(5000)):
        chain = np.column_stack([order[:-1], order[1:]])
        assert not components(5000, chain).any()
        assert len(set(components(5000, chain[1:]))) == 2


@pytest.mark.parametrize("reach", [1e-8, 1e-3, 0.2, 1.0])
@pytest.mark.parametrize("noise", [0.0, 1e-9, 1e-4, 0.1])
def test_points_hang_together_as_by_a_search_tree(reach, noise):
    rng = np.random.default_rng(0)
    points = rng.integers(0, 5, (200, 3)) + noise * rng.normal(size=(200, 3)) + 1000.0
    tree = cKDTree(points).query_pairs(reach, output_type="ndarray")
    found = components(200, close_pairs(points, reach))
    assert found.tolist() == judged(200, tree).tolist()
    assert (len(set(found)) < 200) == (len(tree) > 0)


def test_a_corner_of_many_triangles_is_linked_in_a_row():
    points = np.vstack([np.zeros((50_000, 3)), np.eye(3)])
    links = close_pairs(points, 1e-8)
    assert len(links) == 49_999
    assert set(components(len(points), links)) == {0, 50_000, 50_001, 50_002}
