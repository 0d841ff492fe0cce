"""What a user of FreeCAD selected, as numbers of faces of the part."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cad_implicit.errors import SelectorError

from .freecad import Shape
from .parts import OpenPart

#: Places nearer to each other than this share of the diagonal are one: uniting solids moves nothing farther.
_SAME_PLACE = 1e-5


def face_numbers(part: OpenPart, faces: Sequence[Shape]) -> list[int]:
    """Numbers of faces of a part, as FreeCAD counts them: the very faces, or those in the same place.

    Raises
    ------
    SelectorError
        If the part does not have one of them.
    """
    own = part.shape.Faces
    centres = np.array([tuple(face.CenterOfMass) for face in own])
    limit = _SAME_PLACE * float(np.linalg.norm(part.bounds[1] - part.bounds[0]))
    result = []
    for face in faces:
        number = next((n for n, one in enumerate(own, 1) if one.isSame(face)), 0)
        if not number:
            away = np.linalg.norm(centres - np.array(tuple(face.CenterOfMass)), axis=1)
            number = int(np.argmin(away)) + 1
            if away[number - 1] > limit:
                x, y, z = tuple(face.CenterOfMass)
                raise SelectorError(f"the part has no face around ({x:.4g}, {y:.4g}, {z:.4g}) mm")
        result.append(number)
    return result
