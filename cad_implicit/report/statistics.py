"""Figures of distances: of all, and by region."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from cad_implicit.implicit import FloatArray


@dataclass(frozen=True)
class Statistics:
    """Of distances with signs, in mm; positive where there is too much material.

    Attributes
    ----------
    samples : int
    max, p99, rms, mean : float
        Of absolute values.
    bias : float
        Mean with signs.
    place : tuple of 3 float or None
        Where the largest is.
    """

    samples: int
    max: float
    p99: float
    rms: float
    mean: float
    bias: float
    place: tuple[float, float, float] | None

    def as_dict(self, spacing: float, radius: float) -> dict[str, object]:
        """Figures in mm, and the largest also in spacings and in per cent of the radius."""
        return {**asdict(self), "max_h": self.max / spacing, "max_percent_of_radius": 100 * self.max / radius}


def statistics(values: FloatArray, points: FloatArray) -> Statistics:
    """Figures of distances (N,) at points (N, 3) in mm."""
    if len(values) == 0:
        return Statistics(0, 0.0, 0.0, 0.0, 0.0, 0.0, None)
    size = np.abs(values)
    worst = int(size.argmax())
    x, y, z = points[worst].tolist()
    return Statistics(
        len(values),
        float(size[worst]),
        float(np.percentile(size, 99)),
        float(np.sqrt(np.mean(values * values))),
        float(size.mean()),
        float(values.mean()),
        (x, y, z),
    )
