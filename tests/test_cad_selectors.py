"""Selectors: what they choose, on arrays and beside CadQuery's own; what is wrong with them is said."""

from __future__ import annotations

import numpy as np
import pytest

from cad_implicit.cad.selectors import Candidates, select
from cad_implicit.errors import SelectorError


def box_edges() -> Candidates:
    """Twelve edges of a box 2 x 4 x 6 around the origin: 1-4 along X, 5-8 along Y, 9-12 along Z; number 13 a circle."""
    signs = [(-1, -1), (1, -1), (-1, 1), (1, 1)]
    centres, directions = [], []
    for axis in range(3):
        for a, b in signs:
            centre = np.zeros(3)
            centre[(axis + 1) % 3], centre[(axis + 2) % 3] = a, b
            centres.append(centre * (1, 2, 3))
            directions.append(np.eye(3)[axis])
    convexities = ["convex"] * 8 + ["concave"] * 3 + ["smooth", "seam"]
    return Candidates(
        "edge",
        np.r_[1:13, 15],
        np.array([*centres, (0, 0, 3.5)]),
        np.array([*directions, [np.nan] * 3]),
        ["line"] * 12 + ["circle"],
        convexities,
    )


def chosen(selector: str) -> set[int]:
    edges = box_edges()
    return set(edges.numbers[select(selector, edges)].tolist())


@pytest.mark.parametrize(
    ("selector", "numbers"),
    [
        ("|Z", {9, 10, 11, 12}),
        ("#Z", {1, 2, 3, 4, 5, 6, 7, 8}),
        ("+Z", {9, 10, 11, 12}),
        ("|(0, 0, -2.5)", {9, 10, 11, 12}),
        (">Z", {15}),
        (">>Z[-2]", {3, 4, 6, 8}),
        ("<Z", {1, 2, 5, 7}),
        (">Z[0] and |Z", {9, 10, 11, 12}),
        (">X", {7, 8, 10, 12}),
        ("right", {7, 8, 10, 12}),
        (">XY", {12}),
        ("%LINE and concave", {9, 10, 11}),
        ("%circle", {15}),
        ("all", {*range(1, 13), 15}),
        ("3, 5,7", {3, 5, 7}),
        ("3,5,12 and |Z", {12}),
        ("smooth or seam", {12, 15}),
        ("concave and not >X", {9, 11}),
        ("not concave and >X", {*range(1, 10), 11, 12, 15}),
        ("(not concave) and >X", {7, 8, 12}),
        ("|Z or |X and >Z[-1]", {9, 10, 11, 12}),
        ("|Z exc 9 or 10", {11, 12}),
        ("not not |Z", {9, 10, 11, 12}),
        ("((|X))and((<Y))", {1, 3}),
    ],
)
def test_what_selectors_choose(selector: str, numbers: set[int]) -> None:
    assert chosen(selector) == numbers


def test_negative_direction_chooses_nothing_of_edges_that_run_the_other_way() -> None:
    with pytest.raises(
        SelectorError, match=r"'-Z' selects no edge; the part has 13 edges with numbers up to 15 \(8 con"
    ):
        chosen("-Z")


@pytest.mark.parametrize(
    ("selector", "text"),
    [
        ("", "at its end: expected"),
        ("|W", "at '|W'"),
        ("|Z and", "at its end"),
        ("(|Z", "expected '\\)'"),
        ("|Z |X", "expected 'and'"),
        ("3,14,99", "there is no edge 14, 99"),
        ("curved", "'curved' is no word"),
        ("|(0,0,0)", "must not be zero"),
        ("|Z[1]", "only >"),
        (">>Z[9]", "selects no edge"),
        ("%torus", "selects no edge; .* 12 line, 1 circle"),
        ("3.5", "cannot be read"),
    ],
)
def test_what_is_wrong_is_said(selector: str, text: str) -> None:
    with pytest.raises(SelectorError, match=text.replace("|", r"\|")):
        chosen(selector)


def test_faces_have_no_convexity() -> None:
    faces = Candidates("face", np.arange(1, 3), np.eye(3)[:2], np.eye(3)[:2], ["plane", "cylinder"])
    assert select("-X or +Y", faces).tolist() == [1]
    with pytest.raises(SelectorError, match="'convex' is no word of selectors for a face"):
        select("convex", faces)


@pytest.mark.host
def test_same_edges_as_cadquery() -> None:
    cq = pytest.importorskip("cadquery")
    part = cq.Workplane().box(5.3, 4.1, 3.7).faces(">Z").workplane().circle(1.2).extrude(2.3)
    found = part.edges().vals()
    straight = np.array([edge.geomType() == "LINE" for edge in found])
    edges = Candidates(
        "edge",
        np.arange(1, len(found) + 1),
        np.array([edge.Center().toTuple() for edge in found]),
        np.where(straight[:, None], [edge.tangentAt(0.5).toTuple() for edge in found], np.nan),
        [edge.geomType().lower() for edge in found],
        ["convex"] * len(found),
    )
    for selector in (
        "|Z",
        "#Z",
        "+Y",
        "Z",
        ">Z",
        "<X",
        ">(1,2,0.3)",
        ">>Z[-2]",
        ">X[0]",
        "<<Y[1]",
        "%CIRCLE",
        "not |Z and >X",
        "|Z and not >X or >Y",
        "|Z exc >X or >Y",
        "|Z or >X and >Y",
        "not (<Z or >Z)",
        "bottom",
    ):
        expected = {found.index(edge) for edge in part.edges(selector).vals()}
        assert set(select(selector, edges).tolist()) == expected, selector
