"""Analytic faces: values by formula, gradients by differences, both sides, off the axes."""

from __future__ import annotations

import numpy as np
import pytest

from cad_implicit.faces import AnalyticFace, ConeFace, CylinderFace, FaceDistance, PlaneFace, SphereFace, TorusFace

ORIGIN = np.array([3.1, -2.3, 4.7])
TURN = np.linalg.qr(np.array([[1.0, 0.4, -0.3], [-0.2, 1.0, 0.7], [0.5, -0.6, 1.0]]))[0]
AXIS = TURN[2]
FACES: dict[str, AnalyticFace] = {
    "plane": PlaneFace(ORIGIN, AXIS),
    "cylinder": CylinderFace(ORIGIN, AXIS, 2.9),
    "cone": ConeFace(ORIGIN, AXIS, np.radians(27)),
    "sphere": SphereFace(ORIGIN, 3.3),
    "torus": TorusFace(ORIGIN, AXIS, 4.1, 1.7),
    "apple": TorusFace(ORIGIN, AXIS, 1.3, 2.9),
    "lemon": TorusFace(ORIGIN, AXIS, 1.3, 2.9, "inner"),
}


def profile(name: str) -> np.ndarray:
    """Points (M, 2) close together on the section of a face: distance from the axis, and height."""
    t = np.linspace(-12, 12, 48_001)
    angle = np.linspace(-np.pi, np.pi, 48_001)
    if name == "plane":
        return np.stack([np.abs(t), 0 * t], axis=1)
    if name == "cylinder":
        return np.stack([0 * t + 2.9, t], axis=1)
    if name == "cone":
        along = np.linspace(0, 24, 48_001)
        return np.stack([along * np.sin(np.radians(27)), along * np.cos(np.radians(27))], axis=1)
    ring, tube = {"sphere": (0, 3.3), "torus": (4.1, 1.7), "apple": (1.3, 2.9), "lemon": (-1.3, 2.9)}[name]
    tip = np.arccos(np.clip(-ring / tube, -1, 1))  # where the circle meets the axis
    return np.stack([ring + tube * np.cos(angle * tip / np.pi), tube * np.sin(angle * tip / np.pi)], axis=1)


def inside(name: str, rho: np.ndarray, z: np.ndarray) -> np.ndarray:
    if name == "plane":
        return z < 0
    if name == "cylinder":
        return rho < 2.9
    if name == "cone":
        return rho < z * np.tan(np.radians(27))
    ring, tube = {"sphere": (0, 3.3), "torus": (4.1, 1.7), "apple": (1.3, 2.9), "lemon": (-1.3, 2.9)}[name]
    return np.hypot(rho - ring, z) < tube


def distance_to_line(place: np.ndarray, line: np.ndarray) -> float:
    start, step = line[:-1], np.diff(line, axis=0)
    share = np.clip(((place - start) * step).sum(axis=1) / np.maximum((step**2).sum(axis=1), 1e-300), 0, 1)
    return float(np.hypot(*(start + share[:, None] * step - place).T).min())


def points(count: int = 300) -> np.ndarray:
    return ORIGIN + np.random.default_rng(3).uniform(-4, 4, (count, 3))


@pytest.mark.parametrize("name", FACES)
def test_values_by_the_section(name: str) -> None:
    x = points()
    value = FACES[name](x)
    z = (x - ORIGIN) @ AXIS
    rho = np.linalg.norm(x - ORIGIN - z[:, None] * AXIS, axis=1)
    section = profile(name)
    expected = np.array([distance_to_line(place, section) for place in np.stack([rho, z], axis=1)])
    expected *= np.where(inside(name, rho, z), 1.0, -1.0)
    assert np.abs(value - expected).max() < 1e-6
    outward = -FACES[name].value_and_gradient(x[:1])[1][0]
    for side in (1.0, -1.0):
        assert FACES[name].facing(x[0], side * outward)(x) == pytest.approx(side * value)


@pytest.mark.parametrize("name", FACES)
def test_gradients_by_differences(name: str) -> None:
    x, face, step = points(), FACES[name], 1e-6
    gradient = face.value_and_gradient(x)[1]
    differences = np.stack([(face(x + step * e) - face(x - step * e)) / (2 * step) for e in np.eye(3)], axis=1)
    assert np.abs(gradient - differences).max() < 1e-7
    assert np.linalg.norm(gradient, axis=1) == pytest.approx(1.0)


def test_axes_and_centres_have_a_gradient() -> None:
    places = ORIGIN + np.array([-2.0, 0.0, 2.0])[:, None] * AXIS
    for name, face in FACES.items():
        value, gradient = face.value_and_gradient(places)
        assert np.isfinite(value).all(), name
        assert np.linalg.norm(gradient, axis=1) == pytest.approx(1.0), name


def test_one_nappe_only() -> None:
    """Behind the apex a cone is as far as its apex, not as its other nappe."""
    behind = ORIGIN - 2 * AXIS + 0.7 * TURN[0]
    assert FACES["cone"]([behind]) == pytest.approx(-np.hypot(2, 0.7))


def test_kinds() -> None:
    assert [face.kind for face in FACES.values()] == ["plane", "cylinder", "cone", "sphere", "torus", "torus", "torus"]
    assert all(isinstance(face, FaceDistance) for face in FACES.values())
