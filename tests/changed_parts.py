"""Parts with a face moved, a hole or a chamfer, and what became of contacts, judged apart.

Nothing here uses how the package carries contacts: solids are made by manifold3d and by solving for
vertices, and distances are measured on all triangles by trimesh.
"""

import manifold3d
import numpy as np
import trimesh

import grasp_core as gc

ON_PLANE = 1e-9
"""Distance at which a vertex is on a plane, relative to the part."""
SEGMENTS = 24


def with_face_moved(body, face, distance):
    """The part with one face moved outward by a distance [m], its neighbours' planes kept.

    Each vertex of the face is where the moved plane meets the planes of the other faces there.
    """
    outward = -body.normals
    offsets = np.array([normal @ each.centroid
                        for normal, each in zip(outward, body.faces, strict=True)])  # fmt: skip
    vertices = body.vertices.copy()
    for place, vertex in enumerate(body.vertices):
        here = np.abs(outward @ vertex - offsets) <= ON_PLANE * body.radius
        if not here[face]:
            continue
        wanted = offsets + np.where(np.arange(len(offsets)) == face, distance, 0.0)
        moved, _, rank, _ = np.linalg.lstsq(outward[here], wanted[here])
        assert rank == 3
        assert np.abs(outward[here] @ moved - wanted[here]).max() <= ON_PLANE * body.radius
        vertices[place] = moved
    return gc.Polyhedron.from_mesh(vertices, body.triangles, name=body.name, faces="planar")


def with_hole(body, face, at, radius, depth=None):
    """The part with a round hole drilled into a face at a point; right through if without depth."""
    normal = body.faces[face].normal
    across = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
    across /= np.linalg.norm(across)
    frame = np.column_stack([across, np.cross(normal, across), normal])
    above = 0.1 * body.radius
    length = 4.0 * body.radius if depth is None else depth + above
    drill = manifold3d.Manifold.cylinder(length, radius, radius, SEGMENTS)
    start = np.asarray(at) - above * normal
    placed = drill.transform(np.column_stack([frame, start]))
    return _body_of(_solid_of(body) - placed, body.name)


def with_chamfer(body, one, other, width):
    """The part without a strip along the edge between two faces, cut off at half their angle."""
    assert one != other
    outward = -(body.normals[one] + body.normals[other])
    outward /= np.linalg.norm(outward)
    edge = _common_edge(body, one, other)
    offset = float(outward @ edge) - width
    return _body_of(_solid_of(body).trim_by_plane(-outward, -offset), body.name)


def _common_edge(body, one, other):
    """A point of the edge between two faces."""
    on = [
        np.abs((body.vertices - body.faces[face].centroid) @ body.normals[face])
        <= ON_PLANE * body.radius
        for face in (one, other)
    ]
    shared = body.vertices[on[0] & on[1]]
    assert len(shared) >= 2
    return shared.mean(axis=0)


def _solid_of(body):
    mesh = manifold3d.Mesh64(np.array(body.vertices), np.array(body.triangles, dtype=np.uint64))
    solid = manifold3d.Manifold(mesh)
    assert solid.status() == manifold3d.Error.NoError
    return solid


def _body_of(solid, name):
    mesh = solid.to_mesh64()
    vertices = np.array(mesh.vert_properties)[:, :3]
    return gc.Polyhedron.from_mesh(vertices, mesh.tri_verts, name=name, faces="planar")


def triangles_of(body):
    """Corners of all triangles, (t, 3, 3), and their unit normals into the part, (t, 3)."""
    corners = body.vertices[body.triangles]
    normals, kept = trimesh.triangles.normals(corners)
    return corners[kept], -normals


def distances(point, corners):
    """Distance of a point from each triangle, (t,)."""
    nearest = trimesh.triangles.closest_point(corners, np.tile(point, (len(corners), 1)))
    return np.linalg.norm(nearest - point, axis=1)


def nearest_like(body, point, normal, angle_deg):
    """Distance of the nearest triangle whose normal is within an angle of a given one; or inf."""
    corners, normals = triangles_of(body)
    like = normals @ normal >= np.cos(np.radians(angle_deg) + 1e-9)
    if not like.any():
        return np.inf
    return float(distances(point, corners[like]).min())


def is_on_surface(body, contact):
    """Whether a contact lies on a triangle with its normal, to a billionth of the part's size."""
    corners, normals = triangles_of(body)
    near = distances(contact.position, corners) <= 1e-9 * body.radius
    return bool((np.abs(normals[near] - contact.normal).max(axis=1) <= 1e-7).any())
