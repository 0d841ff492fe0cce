"""Walls and gaps that a ball does not fit, on shapes whose thickness is known; edges do not count."""

from __future__ import annotations

import math

import numpy as np
import pytest
import trimesh
from manifold3d import CrossSection, Manifold
from trimesh.creation import annulus, box, cylinder, icosphere

from cad_implicit.errors import RadiusError
from cad_implicit.mesh import Mesh
from cad_implicit.thickness import thin_spots

ROTATIONS = [trimesh.transformations.rotation_matrix(a, [1, 2 * a, -0.7]) for a in (0.4, 1.3)]


@pytest.fixture(params=ROTATIONS, ids=["turned", "turned more"])
def turned(request):
    def move(shape):
        shape = shape.copy()
        shape.apply_transform(request.param)
        return Mesh(shape.vertices, shape.faces)

    move.matrix = request.param[:3, :3]
    return move


def prism(*corners, height=20.0):
    mesh = Manifold.extrude(CrossSection([np.array(corners)]), height).to_mesh()
    return trimesh.Trimesh(mesh.vert_properties[:, :3].astype(np.float64), mesh.tri_verts)


L_PROFILE = prism((0, 0), (20, 0), (20, 8), (8, 8), (8, 20), (0, 20))
SLOT = prism((0, 0), (30, 0), (30, 20), (16.5, 20), (16.5, 8), (13.5, 8), (13.5, 20), (0, 20))
WEDGE = prism((0, 0), (40, 0), (40 * math.cos(math.pi / 6), 40 * math.sin(math.pi / 6)))
NECK = prism((0, 0), (10, 0), (20, 4), (30, 0), (40, 0), (40, 12), (30, 12), (20, 8), (10, 12), (0, 12))


@pytest.mark.parametrize(
    ("shape", "radius", "side", "thickness"),
    [
        (box((10, 10, 3)), 2.0, "inside", 3.0),
        (box((10, 10, 10)), 6.0, "inside", 10.0),
        (cylinder(1.5, 20, sections=64), 2.0, "inside", 3.0),
        (annulus(1.5, 8, 12, sections=96), 2.0, "outside", 3.0),
        (annulus(6, 8, 12, sections=96), 1.5, "inside", 2.0),
        (SLOT, 2.0, "outside", 3.0),
        (NECK, 3.0, "inside", 4.0),
        (icosphere(subdivisions=4, radius=3.0), 4.0, "inside", 6.0),
    ],
    ids=["plate", "cube", "pin", "hole", "tube", "slot", "neck", "ball"],
)
def test_thickness_is_found(turned, shape, radius, side, thickness):
    spot = thin_spots(turned(shape), radius, side)
    assert spot is not None
    assert spot.thickness == pytest.approx(thickness, rel=0.01)
    assert spot.safe_radius == spot.thickness / 2


@pytest.mark.parametrize(
    ("shape", "radius", "side"),
    [
        (box((10, 10, 10)), 4.9, "inside"),
        (box((10, 10, 10)), 4.9, "outside"),
        (cylinder(1.5, 20, sections=64), 1.49, "inside"),
        (cylinder(1.5, 20, sections=64), 5.0, "outside"),
        (annulus(1.5, 8, 12, sections=96), 1.49, "outside"),
        (SLOT, 1.49, "outside"),
        (L_PROFILE, 3.9, "inside"),
        (L_PROFILE, 3.9, "outside"),
        (WEDGE, 4.0, "inside"),
        (icosphere(subdivisions=4, radius=3.0), 2.9, "inside"),
        (icosphere(subdivisions=4, radius=3.0), 9.0, "outside"),
    ],
)
def test_edges_do_not_count(turned, shape, radius, side):
    assert thin_spots(turned(shape), radius, side) is None


def test_the_edge_of_a_wedge_does_not_hide_a_slot_in_it(turned):
    slit = box((1, 30, 30), transform=trimesh.transformations.translation_matrix([30, 20, 10]))
    shape = trimesh.boolean.difference([WEDGE, slit], engine="manifold")
    spot = thin_spots(turned(shape), 1.0, "outside")
    assert spot is not None
    assert spot.thickness == pytest.approx(1.0, rel=0.01)


def test_place_is_on_the_thin_wall(turned):
    spot = thin_spots(turned(NECK), 3.0, "inside")
    x = np.array(spot.place) @ turned.matrix
    assert abs(x[0] - 20) < 0.5
    assert min(abs(x[1] - 4), abs(x[1] - 8)) < 0.2


def test_the_same_on_every_run_and_number_of_threads(turned):
    mesh = turned(NECK)
    assert thin_spots(mesh, 3.0, threads=1) == thin_spots(mesh, 3.0, threads=2)


@pytest.mark.parametrize("scale", [1e-6, 1e6])
def test_any_scale(scale):
    plate = box((10, 10, 3))
    spot = thin_spots(Mesh(plate.vertices * scale, plate.faces), 2 * scale)
    assert spot.thickness == pytest.approx(3 * scale, rel=1e-6)


@pytest.mark.nojit
def test_every_brep_face_is_looked_at():
    ball, pin = icosphere(subdivisions=3, radius=10), box((0.1, 0.1, 0.1))
    vertices = np.concatenate([ball.vertices, pin.vertices + 20])
    faces = np.concatenate([ball.faces, pin.faces + len(ball.vertices)])
    ids = np.repeat([0, 1], [len(ball.faces), len(pin.faces)])
    spot = thin_spots(Mesh(vertices, faces, ids), 1.0, samples=100)
    assert spot.thickness == pytest.approx(0.1)


@pytest.mark.parametrize("radius", [0.0, -1.0, math.nan, math.inf])
def test_senseless_radius(radius):
    with pytest.raises(RadiusError, match="positive"):
        thin_spots(Mesh(box().vertices, box().faces), radius)


def test_unknown_side():
    with pytest.raises(ValueError, match="sideways"):
        thin_spots(Mesh(box().vertices, box().faces), 1.0, "sideways")


def test_progress_cancels():
    def cancel(stage, fraction):
        raise KeyboardInterrupt(stage)

    with pytest.raises(KeyboardInterrupt, match="thickness"):
        thin_spots(Mesh(box().vertices, box().faces), 1.0, progress=cancel)
