"""Shells and infills of parts, meshes and functions, by both engines, against analytic walls."""

from __future__ import annotations

import numpy as np
import pytest
import shapes

import cad_implicit as ci
from cad_implicit.distance import Surface
from cad_implicit.errors import GeometryWarning, RadiusError, SpacingError
from cad_implicit.shelling import Side
from cad_implicit.sizing import Engine

H = 0.4


def block() -> ci.Mesh:
    """Box of 12 x 10 x 8 mm, turned off the axes."""
    return shapes.as_mesh(shapes.box([-6, -5, -4], [6, 5, 4]))


def prism(grown: float) -> ci.Mesh:
    return shapes.as_mesh(shapes.box([-6 - grown, -5 - grown, -4 - grown], [6 + grown, 5 + grown, 4 + grown]))


def test_inward_shell_of_a_mesh() -> None:
    hollow = ci.shell(block(), 1.0, spacing=H)
    assert hollow.spacing == H
    mesh = ci.contour(hollow)
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(12 * 10 * 8 - 10 * 8 * 6, rel=1e-4)
    truth = np.minimum(
        ci.MeshDistance(block()).unsigned(mesh.vertices), ci.MeshDistance(prism(-1)).unsigned(mesh.vertices)
    )
    assert truth.max() < 1e-3 * H
    # the inner corners are sharp
    corners = Surface(mesh).closest(prism(-1).vertices)[0]
    assert corners.max() < 0.02 * H


@pytest.mark.parametrize("engine", ["exact", "reinit"])
@pytest.mark.parametrize("side", ["inward", "outward", "both"])
def test_walls_of_a_ball(engine: Engine, side: Side) -> None:
    ball = ci.sphere(6).moved((0.13, 0.37, 0.21))
    wall = 1.2
    hollow = ci.shell(ball, wall, side=side, spacing=H / 2, engine=engine)
    mesh = ci.contour(hollow)
    assert mesh.is_watertight
    outer = {"inward": 6.0, "outward": 6 + wall, "both": 6 + wall / 2}[side]
    radius = np.linalg.norm(mesh.vertices - [0.13, 0.37, 0.21], axis=1)
    outside = radius > outer - wall / 2
    tolerance = (0.001 if engine == "exact" else 0.1) * H
    assert np.abs(radius[outside] - outer).max() < tolerance
    assert np.abs(radius[~outside] - (outer - wall)).max() < tolerance
    low, high = hollow.bounds
    np.testing.assert_allclose(high - low, 2 * outer, atol=1e-9)


@pytest.mark.parametrize("engine", ["exact", "reinit"])
def test_walls_are_as_thick_as_asked_on_planes(engine: Engine) -> None:
    """At 1,000 points of the outer faces, away from the edges: the distance to the inner faces."""
    thickness, h = 1.1, 0.3
    mesh = ci.contour(ci.shell(block(), thickness, spacing=h, engine=engine))
    local = (mesh.vertices - shapes.SHIFT) @ shapes.TURN
    depth = (np.array([6, 5, 4]) - np.abs(local)).min(axis=1)
    outer = depth < thickness / 2
    inner = Surface(ci.Mesh(mesh.vertices, mesh.faces[~outer[mesh.faces].any(axis=1)]))
    middle = np.sort(np.array([6, 5, 4]) - np.abs(local), axis=1)[:, 1] > 2
    start = np.random.default_rng(0).choice(np.flatnonzero(outer & middle), 1000)
    found = inner.closest(mesh.vertices[start])[0]
    assert np.abs(found - thickness).max() < (1e-3 if engine == "exact" else 0.1) * h


def test_outward_shell_of_a_mesh_is_round_outside() -> None:
    mesh = ci.contour(ci.shell(block(), 1.0, side="outward", spacing=H))
    assert mesh.is_watertight
    a, b, c = 12, 10, 8
    grown = a * b * c + 2 * (a * b + b * c + c * a) + np.pi * (a + b + c) + 4 / 3 * np.pi
    assert 0.995 < mesh.volume / (grown - a * b * c) < 1  # the facets of the round edges cut off a little


def test_operations_go_on_from_a_shell() -> None:
    hollow = ci.shell(block(), 2.0, spacing=H)
    rounded = ci.contour(ci.round(hollow, 0.5))
    assert rounded.is_watertight
    assert rounded.volume < ci.contour(hollow).volume


def test_shell_in_the_plane() -> None:
    ring = ci.shell(ci.circle(5), 1.0, spacing=0.1)
    curves = ci.contour_curves(ring)  # type: ignore[arg-type]
    radii = sorted(float(np.linalg.norm(c, axis=1).mean()) for c in curves)
    assert radii == pytest.approx([4, 5], abs=5e-3)


def test_shell_of_a_convolution_surface_by_the_papers_way() -> None:
    bone = ci.convolution([[[-8, 0, 0], [1, 1, 0]], [[1, 1, 0], [7, -4, 1]]], 2.5)
    hollow = ci.shell(bone, 0.8, spacing=0.3)
    assert isinstance(hollow, ci.Field)
    mesh = ci.contour(hollow)
    assert mesh.is_watertight
    whole = ci.contour(bone, 0.3)
    on_surface = ci.MeshDistance(whole).unsigned(mesh.vertices)
    wall = on_surface[on_surface > 0.4]
    assert np.abs(wall - 0.8).max() < 0.35 * 0.3
    assert on_surface[on_surface <= 0.4].max() < 0.1 * 0.3


@pytest.mark.parametrize("kind", ["gyroid", "octet", "rods", "cells"])
@pytest.mark.parametrize("engine", ["exact", "reinit"])
def test_infill_is_skin_and_lattice(kind: str, engine: Engine) -> None:
    ball = ci.sphere(6).moved((0.13, 0.37, 0.21))
    filled = ci.infill(ball, 4.0, 0.7, kind=kind, skin=1.0, spacing=0.2, engine=engine)  # type: ignore[arg-type]
    lattice = {
        "gyroid": ci.tpms("gyroid", 4.0, 0.7),
        "octet": ci.strut_lattice("octet", 4.0, 0.7),
        "rods": ci.slab_lattice(4.0, 0.7),
        "cells": ci.slab_lattice(4.0, 0.7, closed=True),
    }[kind]
    x = np.random.default_rng(4).uniform(-7, 7, (4000, 3))
    truth = np.minimum(ball(x), np.maximum(1.0 - ball(x), lattice(x)))
    clear = np.abs(truth) > (1e-9 if engine == "exact" else 0.12)
    np.testing.assert_array_equal(filled(x)[clear] > 0, truth[clear] > 0)
    mesh = ci.contour(filled)
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx((truth > 0).mean() * 14**3, rel=0.1)


def test_infill_without_a_skin_and_graded() -> None:
    part = block()
    distance = ci.MeshDistance(part)
    bare = ci.infill(part, 4.0, 0.8, skin=0, spacing=0.3)
    x = np.random.default_rng(4).uniform(-8, 8, (2000, 3))
    np.testing.assert_allclose(bare(x), np.minimum(distance(x), ci.tpms("gyroid", 4.0, 0.8)(x)))
    wall = ci.graded(distance, 1.0, 0.5, 4.0)
    cell = ci.graded(distance, 3.0, 5.0, 4.0)
    dense = ci.infill(part, cell, wall, skin=0.6, spacing=0.3)
    assert ci.contour(dense).is_watertight
    with pytest.raises(ValueError, match="skin"):
        ci.infill(part, cell, wall)


def test_default_spacing_resolves_the_walls() -> None:
    filled = ci.infill(block(), 5.0, 0.9)
    assert filled.spacing is not None
    assert filled.spacing <= 0.3 + 1e-9


def test_bad_input() -> None:
    part = block()
    for thickness in (0, -1, float("nan"), 4.0, 50):
        with pytest.raises(RadiusError):
            ci.shell(part, thickness)
    thin = ci.shell(part, 0.5, spacing=0.2)
    with pytest.raises(RadiusError, match="nowhere more than"):
        ci.shell(ci.MeshDistance(ci.contour(thin)), 1.0)
    with pytest.raises(ValueError, match="side"):
        ci.shell(part, 1, side="left")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="kind"):
        ci.infill(part, 4, 0.5, kind="foam")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="graded"):
        ci.infill(part, ci.graded(ci.sphere(1), 1, 2, 3), 0.5, kind="bcc")
    with pytest.raises(SpacingError, match="no end"):
        ci.shell(ci.plane("z"), 1.0)
    with pytest.warns(GeometryWarning, match="too thin for a spacing of 0.6 mm"):
        ci.shell(part, 0.5, spacing=0.6)


@pytest.mark.parametrize("skin", [0.0, 0.6])
def test_lattice_is_sampled_only_where_it_counts(skin: float) -> None:
    """The result is that of sampling it everywhere, to the sign of every node and the value next to the surface."""
    ball, wall = ci.sphere(4.0), 0.5
    lattice = ci.tpms("gyroid", 3.0, wall)
    sparse = ci.infill(ball, 3.0, wall, kind=lattice, skin=skin, spacing=0.2, engine="reinit")
    assert isinstance(sparse, ci.Field)
    phi = ball(sparse.grid.nodes())
    everywhere = lattice(sparse.grid.nodes())
    whole = np.minimum(phi, np.maximum(skin - phi, everywhere) if skin else everywhere)
    near = np.abs(whole) < 0.3
    assert (np.sign(sparse.values.ravel()) == np.sign(whole))[np.abs(whole) > 0.01].all()
    assert np.abs(sparse.values.ravel() - whole)[near & (phi > -0.3)].max() < 0.03


def test_a_lattice_of_your_own() -> None:
    lattice = ci.slab_lattice(2.0, 0.4) | ci.strut_lattice("bcc", 2.0, 0.4)
    filled = ci.infill(ci.box((4, 4, 4)), 2.0, 0.4, kind=lattice, skin=0.3, spacing=0.1)
    x = np.random.default_rng(0).uniform(-1.6, 1.6, (500, 3))
    assert ((filled(x) > 0) == (lattice(x) > 0)).all()
