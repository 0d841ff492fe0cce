"""Triangles back to surfaces: parameters of known ones, none for free-form ones, what corners alone do not tell."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest
from sheets import AXIS, SHEETS, SHIFT, sheet, torus, wave

from cad_implicit import Mesh
from cad_implicit.faces import TorusFace
from cad_implicit.fitted_faces import Piece, chords, fitted


@pytest.mark.parametrize("inside_out", [False, True])
@pytest.mark.parametrize("name", SHEETS)
def test_parameters_of_known_surfaces(name: str, inside_out: bool) -> None:
    surface, u, v, face = SHEETS[name]
    mesh = sheet(surface, u, v)
    mesh = Mesh(mesh.vertices, mesh.faces[:, ::-1]) if inside_out else mesh
    found = fitted(Piece.of(mesh), mesh.diagonal)
    assert found is not None
    assert found.kind == face.kind
    for own in fields(face):
        if own.name in ("radius", "half_angle", "ring", "tube"):
            assert getattr(found, own.name) == pytest.approx(getattr(face, own.name), rel=1e-10), own.name
    # the whole surface, and on which side the material is
    x = SHIFT + np.random.default_rng(1).uniform(-3, 3, (200, 3))
    side = -1.0 if inside_out else 1.0
    assert found(x) == pytest.approx(side * face(x), abs=1e-9)


@pytest.mark.parametrize("name", SHEETS)
def test_single_precision(name: str) -> None:
    """STL files round coordinates to 6e-8 of them."""
    surface, u, v, face = SHEETS[name]
    exact = sheet(surface, u, v)
    mesh = Mesh(exact.vertices.astype(np.float32), exact.faces)
    found = fitted(Piece.of(mesh), mesh.diagonal)
    assert found is not None
    assert found.kind == face.kind
    assert np.abs(found(exact.vertices)).max() < 1e-6


def test_free_form_is_none_of_them() -> None:
    for count in (8, 40):
        mesh = sheet(wave, np.linspace(0, 3, count), np.linspace(0, 2, count))
        assert fitted(Piece.of(mesh), mesh.diagonal) is None


def test_corners_alone_do_not_tell() -> None:
    """All corners of a disc are on the torus that rounds its rim, with the disc's normal."""
    angle = np.linspace(0, 2 * np.pi, 30, endpoint=False)
    rim = SHIFT + np.outer(6 * np.cos(angle), _across()[0]) + np.outer(6 * np.sin(angle), _across()[1]) + 0.5 * AXIS
    disc = Mesh(rim, [[0, i, i + 1] for i in range(1, 29)])
    rounding = TorusFace(SHIFT, AXIS, 6.0, 0.5)
    assert np.abs(rounding(rim)).max() < 1e-12
    assert not chords(rounding, Piece.of(disc), 1e-6)[1:-1].any()
    strip = sheet(torus(6, 0.5), np.linspace(0, 6.2, 60), np.linspace(0, 1.5, 9))
    assert chords(rounding, Piece.of(strip), 1e-6).all()
    found = fitted(Piece.of(disc), disc.diagonal)
    assert found is not None
    assert found.kind == "plane"


def _across() -> np.ndarray:
    return np.linalg.svd(AXIS[None])[2][1:]
