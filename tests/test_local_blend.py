"""Local blends of B-rep parts off the axes: volumes by formula, vertices on exact blends, all else bit for bit."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import cad_parts
import edge_parts
import numpy as np
import pytest
from dual_oracles import status

import cad_implicit as ci
from cad_implicit.errors import RadiusError
from cad_implicit.implicit import FloatArray
from validation.intersections import count_intersections

pytestmark = pytest.mark.host
pytest.importorskip("OCP")

#: Of radius 1: area between a right angle and the arc in it; its moment about one leg; what two of them have in common
#: that cross at a corner.
SPANDREL = 1 - np.pi / 4
MOMENT = 5 / 6 - np.pi / 4
CROSSED = 5 / 3 - np.pi / 2

#: Spacings in a radius.
CELLS = 4.0


def ring(wall: float, radius: float) -> float:
    """Volume in the corner around a cylinder; inside of it for a negative radius of the wall."""
    side = np.sign(wall)
    return 2 * np.pi * (abs(wall) * SPANDREL * radius**2 + side * MOMENT * radius**3)


def box() -> Any:
    return cad_parts.box((20, 24, 28))


def cube() -> Any:
    return cad_parts.box((10, 10, 10))


def angle() -> Any:
    """L 50 x 50, 14 thick and 46 deep."""
    return edge_parts.fused(cad_parts.box((50, 46, 14)), cad_parts.box((14, 46, 50)))


def boss() -> Any:
    """Boss 20 x 20 x 15 on a plate."""
    return edge_parts.fused(cad_parts.box((50, 50, 10), (-25, -25, -10)), cad_parts.box((20, 20, 25), (-10, -10, -10)))


def blind_hole() -> Any:
    return edge_parts.cut(cad_parts.box((30, 30, 20), (-15, -15, -8)), edge_parts.cylinder(5, 20))


def slot() -> Any:
    """Slot 12 wide with round ends, 14 long between their centres."""
    tools = [edge_parts.cylinder(6, 30, (x, 0, 0)) for x in (-7, 7)]
    return edge_parts.cut(
        cad_parts.box((50, 30, 20), (-25, -15, -8)), edge_parts.fused(cad_parts.box((14, 12, 30), (-7, -6, 0)), *tools)
    )


def boss_at_border() -> Any:
    """Boss of radius 10, 1 mm from the border of its plate."""
    return edge_parts.fused(cad_parts.box((40, 40, 10), (-11, -20, -10)), edge_parts.cylinder(10, 22, (0, 0, -10)))


def low_wall(height: float = 1.2) -> Any:
    """Step so high, 30 long."""
    return edge_parts.fused(cad_parts.box((30, 20, 8)), cad_parts.box((30, 10, 8 + height)))


def post() -> Any:
    """Post of radius 5.5 that runs into two walls, which are 4 from its axis and as high again."""
    walls = edge_parts.fused(cad_parts.box((4, 20, 16), (4, -12, -10)), cad_parts.box((20, 4, 16), (-12, 4, -10)))
    floor = cad_parts.box((20, 20, 3), (-12, -12, -10))
    return edge_parts.fused(floor, walls, edge_parts.cylinder(5.5, 10, (0, 0, -10)))


BASE = [(10.0, 0.0, 0.0), (-10.0, 0.0, 0.0), (0.0, 10.0, 0.0), (0.0, -10.0, 0.0)]
UPRIGHT = [(x, y, 7.5) for x in (-10.0, 10.0) for y in (-10.0, 10.0)]
ENDS = [(32.0, 0.0, 14.0), (14.0, 0.0, 32.0)]


def chosen(part: Any, edges: str | Sequence[tuple[float, float, float]]) -> list[ci.Edge]:
    """Edges that a selector chooses, or whose centres are at some points."""
    found = ci.edges(part, edges if isinstance(edges, str) else "all")
    if isinstance(edges, str):
        return list(found)
    near = [[edge for edge in found if np.linalg.norm(edge.centre - point) < 1e-6] for point in edges]
    assert [len(one) for one in near] == [1] * len(edges)
    return [one for (one,) in near]


@dataclass(frozen=True)
class Case:
    """A blend, by how much it changes the volume, and whether the exact kernel can do it."""

    part: Callable[[], Any]
    edges: str | Sequence[tuple[float, float, float]]
    radius: float
    change: float | None
    kernel: bool = True
    kept: bool = True


def border_volume() -> float:
    """Fill of radius 2 around :func:`boss_at_border`: what is under all balls that touch the boss and the plate.

    They touch the plate's border where its top ends too early.
    """
    turn = np.linspace(0, np.pi, 1441)
    x, y = 12 * np.cos(turn), 12 * np.sin(turn)
    z = np.sqrt(4 - np.maximum(-11 - x, 0) ** 2)
    step = 0.01
    rho, total = np.arange(10 + step / 2, 12, step), 0.0
    for number in range(0, 1441, 6):  # over half of the boss
        a, b = rho * np.cos(turn[number]), rho * np.sin(turn[number])
        near = slice(max(number - 160, 0), number + 161)
        across = (a[:, None] - x[near]) ** 2 + (b[:, None] - y[near]) ** 2
        height = np.where(across < 4, z[near] - np.sqrt(np.maximum(4 - across, 0)), np.inf).min(axis=1)
        weight = 0.5 if number in (0, 1440) else 1.0
        total += weight * float((rho * height)[a > -11].sum()) * step * np.pi / 240
    return 2 * total


def low_wall_area() -> float:
    """Section of the fill of radius 2 at a wall 1.2 high, whose top border the ball touches."""
    away = np.sqrt(2**2 - 0.8**2)
    return float(2 * away - (0.8 * away + 4 * np.arcsin(away / 2)) / 2)


CASES = {
    "box, one": Case(box, [(10, 0, 0)], 2, -SPANDREL * 4 * 20),
    "box, two of three": Case(box, [(10, 0, 0), (0, 12, 0)], 2, -SPANDREL * 4 * 44 + CROSSED * 8, kernel=False),
    "box, all": Case(box, "all", 2, -SPANDREL * 4 * 4 * (72 - 12) - (8 - 4 / 3 * np.pi) * 8, kept=False),
    "cube, ball": Case(cube, "all", 5, 4 / 3 * np.pi * 125 - 1000, kernel=False, kept=False),
    "angle, one end": Case(angle, ENDS[:1], 2, -SPANDREL * 4 * 36),
    "angle, two ends": Case(angle, ENDS, 2, -SPANDREL * 4 * 72 - CROSSED * 8),
    "angle, all": Case(angle, "all", 2, None, kept=False),
    "boss, one": Case(boss, BASE[:1], 2, SPANDREL * 4 * 20),
    "boss, base": Case(boss, BASE, 2, SPANDREL * 4 * 80 + 4 * CROSSED * 8),
    "boss, base and upright": Case(
        boss, BASE + UPRIGHT, 2, SPANDREL * 4 * 4 * 16 + ring(2, 2) - SPANDREL * 4 * 4 * 15, kernel=False
    ),
    "blind hole, hemisphere": Case(blind_hole, "concave", 5, ring(-5, 5), kernel=False),
    "slot": Case(slot, "concave and %circle", 2, ring(-6, 2) + 2 * 14 * SPANDREL * 4),
    "slot, narrow": Case(slot, "concave and %circle", 5.9, ring(-6, 5.9) + 2 * 14 * SPANDREL * 5.9**2),
    "boss at border": Case(boss_at_border, "concave", 2, border_volume()),
    "wall as high as the radius": Case(lambda: low_wall(2), "concave", 2, 30 * SPANDREL * 4, kernel=False),
    "low wall": Case(low_wall, "concave", 2, 30 * low_wall_area(), kernel=False),
}


def kernel_blend(part: Any, numbers: Sequence[int], radius: float) -> Any:
    from OCP.BRepFilletAPI import BRepFilletAPI_MakeFillet
    from OCP.TopAbs import TopAbs_EDGE

    from cad_implicit.cad import occ

    maker = BRepFilletAPI_MakeFillet(part)
    known = occ.shape_map(part, TopAbs_EDGE)
    for number in numbers:
        maker.Add(radius, occ.as_edge(known.FindKey(number)))
    return maker.Shape()


def check_sound(mesh: ci.Mesh) -> None:
    assert mesh.is_watertight
    assert status(mesh) == "NoError"
    assert count_intersections(mesh) == 0


def check_near(off: FloatArray, spacing: float) -> None:
    """Vertices are on the surface, single ones at creases nearly."""
    assert np.abs(off).max() < 0.06 * spacing
    assert (np.abs(off) > 0.02 * spacing).mean() < 0.01


def off_surface(points: FloatArray, shape: Any) -> FloatArray:
    """Distances (N,) to the surface of a solid, by the kernel's projection."""
    from OCP.TopAbs import TopAbs_SHELL

    from cad_implicit.cad import occ

    return cad_parts.distance_to_face(points, next(occ.explore(shape, TopAbs_SHELL)))


def new_vertices(mesh: ci.Mesh, part: ci.Mesh) -> FloatArray:
    old = set(map(bytes, part.vertices))
    return mesh.vertices[[bytes(vertex) not in old for vertex in mesh.vertices]]


@pytest.mark.parametrize("name", CASES)
def test_blend(name: str) -> None:
    from cad_implicit.cad import occ

    case = CASES[name]
    part = cad_parts.moved(case.part())
    numbers = [edge.number for edge in chosen(case.part(), case.edges)]
    h = case.radius / CELLS
    blend = ci.fillet(part, case.radius, edges=numbers, spacing=h)
    mesh, before = ci.contour(blend), blend.parent.mesh
    check_sound(mesh)

    exact = kernel_blend(part, numbers, case.radius) if case.kernel else None
    truth = case.change
    if truth is None:
        truth = occ.volume(exact) - occ.volume(part)
    elif exact is not None:
        assert occ.volume(exact) - occ.volume(part) == pytest.approx(truth, rel=2e-3)
    # chords of an arc take away (pi / 2) (h / r)² / 12 of the spandrel's 1 - pi / 4, or fill in as much
    change = (mesh.volume - before.volume) / truth
    assert 1 < change < 1 + 1.2 * np.pi / 24 / CELLS**2 / SPANDREL

    found = new_vertices(mesh, before)
    if exact is not None:
        some = np.random.default_rng(1).choice(len(found), min(len(found), 250), replace=False)
        check_near(off_surface(found[some], exact), h)
    lines = np.concatenate([dense(edge.points) for edge in ci.edges(part) if edge.number in numbers])
    away = np.linalg.norm(before.vertices[:, None] - lines, axis=2).min(axis=1)
    far = before.vertices[away > 1.5 * case.radius + 3 * h]
    assert case.kept == bool(len(far))
    assert set(map(bytes, far)) <= set(map(bytes, mesh.vertices))


def dense(line: FloatArray) -> FloatArray:
    """More points of a polyline."""
    at = np.arange(len(line))
    return np.stack([np.interp(np.linspace(0, at[-1], 40), at, column) for column in line.T], axis=1)


@pytest.mark.parametrize("radius", [2.0, 11.0])
def test_rounded_box_is_that_by_its_formula(radius: float) -> None:
    """All of its edges: cylinders and spheres; a cylinder remains where two of them meet in the middle of a face."""
    size = np.array([22.0, 24.0, 28.0])
    part = cad_parts.moved(cad_parts.box(tuple(size)))
    blend = ci.round(part, radius, edges="all", spacing=radius / CELLS)
    mesh = ci.contour(blend)
    check_sound(mesh)
    x = np.abs(local(part, mesh.vertices) - size / 2) - (size / 2 - radius)
    away = np.linalg.norm(np.maximum(x, 0), axis=1) + np.minimum(x.max(axis=1), 0) - radius
    check_near(away, blend.spacing)


def local(part: Any, points: FloatArray) -> FloatArray:
    """Points in the frame of a part before it was moved."""
    motion = part.Location().Transformation()
    rows = np.array([[motion.Value(i, j) for j in (1, 2, 3, 4)] for i in (1, 2, 3)])
    return (points - rows[:, 3]) @ rows[:, :3]


def test_low_wall_is_filled_to_its_top_border() -> None:
    part = cad_parts.moved(low_wall())
    blend = ci.fillet(part, 2, edges="concave", spacing=0.5)
    found = local(part, new_vertices(ci.contour(blend), blend.parent.mesh))
    centre = np.array([10 + np.sqrt(2**2 - 0.8**2), 10.0])
    x, y, z = found.T
    off = np.abs(np.hypot(y - centre[0], z - centre[1]) - 2)
    off = np.where((x > 1e-9) & (x < 30 - 1e-9), off, np.minimum(off, 0.0))
    assert off.max() < 0.02 * 0.5
    assert np.ptp(x) == pytest.approx(30)
    assert z.min() == pytest.approx(8, abs=1e-2)
    assert z.max() == pytest.approx(9.2, abs=1e-2)


def test_round_of_a_post_in_a_corner_stays_out_of_the_walls() -> None:
    """The balls touch the top within 3.9 of the axis: they never get clear of the walls, at which both arcs end."""
    part = cad_parts.moved(post())
    arcs = [edge.number for edge in ci.edges(post(), "convex") if (np.hypot(*edge.points.T[:2]) < 5.51).all()]
    assert len(arcs) == 2
    blend = ci.round(part, 1.6, edges=arcs, spacing=0.4)
    points = np.random.default_rng(3).uniform([-6, -6, -3], [7, 7, 2], (20000, 3))
    x, y, z = points.T
    rho = np.hypot(x, y)
    inner, wall = np.minimum(5.5 - rho, -z), np.maximum(x, y) - 4
    ring = np.minimum(np.hypot(rho - 3.9, z + 1.6) - 1.6, np.minimum(rho - 3.9, z + 1.6))
    truth = np.maximum(np.minimum(inner, -ring), wall)
    clear = np.abs(truth) > 0.01
    zero = local(part, np.zeros((1, 3)))
    value = blend(np.linalg.solve((local(part, np.eye(3)) - zero).T, (points - zero).T).T)
    assert (value > 0)[clear].tolist() == (truth > 0)[clear].tolist()


def test_fillet_goes_around_a_rib_whose_top_is_one_round() -> None:
    """Rib as wide as two balls at a wall: what is left of its top's end has no length."""
    rib = edge_parts.fused(cad_parts.box((6, 30, 24), (-6, -15, 0)), cad_parts.box((26, 4, 12), (-1, -2, 0)))
    lines = [(12.5, -2.0, 12.0), (12.5, 2.0, 12.0), (0.0, -2.0, 6.0), (0.0, 2.0, 6.0), (0.0, 0.0, 12.0)]
    numbers = [edge.number for edge in chosen(rib, lines)]
    part = cad_parts.moved(rib)
    blend = ci.fillet(part, 2.0, edges=numbers, spacing=0.5)
    check_sound(ci.contour(blend))
    ((spine, _),) = blend.laid["concave"].spines
    x, y, z = local(part, spine.centres).T
    np.testing.assert_allclose(x, 2, atol=1e-6)
    np.testing.assert_allclose(np.hypot(y, np.maximum(z - 10, 0)), 4, atol=1e-5)


def test_fillet_rolls_over_the_round_of_a_border_that_it_touches() -> None:
    """Boss tangent to a plate's side: the ball touches the rounded plate."""
    tangent = edge_parts.fused(cad_parts.box((20, 20, 10), (-15, -10, -10)), edge_parts.cylinder(5, 20, (0, 0, -10)))
    part = cad_parts.moved(tangent)
    blend = ci.fillet(
        part,
        1.0,
        edges=[edge.number for edge in ci.edges(part, "all") if edge.convexity in ("convex", "concave")],
        spacing=0.3,
    )
    check_sound(ci.contour(blend))
    ((spine, _),) = blend.laid["concave"].spines
    x, y, z = local(part, spine.centres).T
    np.testing.assert_allclose(np.hypot(x, y), 6, atol=1e-6)
    np.testing.assert_allclose(np.hypot(np.maximum(x - 4, 0), z + 1), 2, atol=1e-6)


@pytest.mark.parametrize("concave", [False, True])
def test_radius_that_grows_touches_its_balls(concave: bool) -> None:
    length, side = 46.0, 1.0 if concave else -1.0
    shape, edges, corner = angle(), "concave", (14.0, 14.0)
    if not concave:
        shape, edges, corner = cad_parts.box((30, 46, 30)), [(30.0, 23.0, 30.0)], (30.0, 30.0)
    part = cad_parts.moved(shape)
    (edge,) = chosen(shape, edges)
    blend = ci.fillet(part, (1.0, 4.0), edges=edge.number, spacing=0.5)
    mesh = ci.contour(blend)
    check_sound(mesh)
    found = local(part, new_vertices(mesh, blend.parent.mesh))
    along = found[:, 1] if edge.points[0, 1] < edge.points[-1, 1] else length - found[:, 1]
    across = side * (found[:, [0, 2]] - corner)  # from the edge towards the balls
    inner = (along > 1) & (along < length - 1)
    at = np.linspace(0, length, 4601)
    radius = 1 + 3 * at / length
    gap = np.full(inner.sum(), np.inf)
    for s, r in zip(at, radius, strict=True):
        gap = np.minimum(gap, np.sqrt(((across[inner] - r) ** 2).sum(axis=1) + (along[inner] - s) ** 2) - r)
    assert inner.sum() > 300
    assert np.abs(gap).max() < 0.02 * 0.5
    assert ((across[inner] > -1e-2) & (across[inner] < 4)).all()


def test_chamfers() -> None:
    """Two of them have a pyramid in common where they cross in the hollow; three leave a flat corner."""
    cases = (
        (box, "all", (2.0, None), -(12 * 2 * 24 - 8 * 16 / 3)),
        (boss, BASE, (2.0, None), 80 * 2 + 4 * 8 / 3),
        (box, [(0.0, 0.0, 14.0)], (1.0, 3.0), -42.0),
        (blind_hole, "concave", (2.0, 3.0), None),
    )
    for shape, edges, lengths, truth in cases:
        part = cad_parts.moved(shape())
        numbers = [edge.number for edge in chosen(shape(), edges)]
        blend = ci.chamfer(part, *lengths, edges=numbers, spacing=0.7 if edges == "all" else 0.45)
        mesh = ci.contour(blend)
        check_sound(mesh)
        change = mesh.volume - blend.parent.mesh.volume
        if truth is not None:
            assert change == pytest.approx(truth, rel=1e-4)
        else:  # around the floor, by Pappus: the side on the left of the edge is unknown
            areas = [2 * np.pi * (5 - a / 3) * 3 for a in (2, 3)]
            assert min(abs(change / area - 1) for area in areas) < 5e-3


def test_ball_that_does_not_fit_names_the_edge_and_what_fits() -> None:
    part = cad_parts.moved(blind_hole())
    (edge,) = chosen(blind_hole(), "concave")
    with pytest.raises(RadiusError, match=rf"edge {edge.number}\b.*largest radius for these edges is (5|4\.99\d*) mm"):
        ci.fillet(part, 5.5, edges=edge.number, spacing=1)
    with pytest.raises(RadiusError, match=r"edges? \d+.*largest radius for these edges is (10|9\.99\d*) mm"):
        ci.round(cad_parts.moved(box()), 13, edges="all", spacing=3)


@pytest.mark.parametrize("name", ["angle, two ends", "boss, base", "slot"])
def test_triangles_alone_do_as_well(name: str) -> None:
    """The same edges of the part's mesh: faces are found in its triangles."""
    case = CASES[name]
    part = cad_parts.moved(case.part())
    edges = [edge for edge in ci.edges(part) if edge.number in {e.number for e in chosen(case.part(), case.edges)}]
    coarse = ci.to_mesh(part, tolerance=0.005)
    bare = ci.Mesh(coarse.vertices, coarse.faces)
    middles = np.array([dense(edge.points)[20] for edge in edges])
    numbers = set()
    for edge in ci.edges(bare):
        gaps = np.linalg.norm(dense(edge.points)[:, None] - middles, axis=2).min(axis=0)
        if edge.convexity == edges[0].convexity and gaps.min() < 1.5:
            numbers.add(edge.number)
    blend = ci.fillet(bare, case.radius, edges=sorted(numbers), spacing=case.radius / CELLS)
    mesh = ci.contour(blend)
    check_sound(mesh)
    change = (mesh.volume - bare.volume) / case.change
    assert 0.995 < change < 1.005 + 1.2 * np.pi / 24 / CELLS**2 / SPANDREL
