"""Depths of a surface by rays that are cut with every triangle, without any graphics."""

import numpy as np

ALONG = 1e-12
"""Share of the triangle's size below which a ray is parallel to it."""


def ray_depths(body, pose, matrix, shape):
    """Distance along the camera's z axis of the nearest triangle that each pixel's ray meets, or
    0, and how near the ray comes to the edges of triangles, in their barycentric coordinates."""
    rows, columns = np.indices(shape)
    x = (columns + 0.5 - matrix[0, 2]) / matrix[0, 0]
    y = (rows + 0.5 - matrix[1, 2]) / matrix[1, 1]
    rays = np.stack([x, y, np.ones_like(x)], axis=-1).reshape(-1, 3)
    corners = (body.vertices[body.triangles] - pose[:3, 3]) @ pose[:3, :3]
    one, two = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    best, edge = np.full(len(rays), np.inf), np.full(len(rays), np.inf)
    for base, u, v in zip(corners[:, 0], one, two, strict=True):
        across = np.cross(rays, v)
        size = across @ u
        flat = np.abs(size) <= ALONG * np.linalg.norm(u) * np.linalg.norm(v)
        size = np.where(flat, 1.0, size)
        a = -(across @ base) / size
        turned = np.cross(-base, u)
        b = (rays @ turned) / size
        z = (turned @ v) / size
        inside = np.minimum(np.minimum(a, b), 1.0 - a - b)
        edge = np.where(flat, edge, np.minimum(edge, np.abs(inside)))
        hit = ~flat & (inside >= 0.0) & (z > 0.0) & (z < best)
        best = np.where(hit, z, best)
    return np.where(np.isinf(best), 0.0, best).reshape(shape), edge.reshape(shape)
