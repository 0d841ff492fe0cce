"""One page for a validation: verdict, tables, charts, and the part in 3-D, in a single file that works offline."""

from __future__ import annotations

import html
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from cad_implicit.errors import CadImplicitError
from cad_implicit.implicit import FloatArray
from cad_implicit.mesh import Mesh
from cad_implicit.simplifying import simplify

from .measuring import REGIONS
from .validation import BY_THE_BALL, Validation

#: Meshes of more triangles are simplified for the page, within this share of the spacing.
_MOST = 150_000
_COARSE = 0.25

#: Colours of errors: too little, none, too much material.
_SCALE = "RdBu_r"

_STYLE = """
body{font:15px/1.45 system-ui,sans-serif;margin:2rem auto;max-width:1180px;padding:0 1rem;color:#1c2430}
h1{font-size:1.5rem;margin:0 0 .3rem}h2{font-size:1.1rem;margin:1.8rem 0 .5rem}
.verdict{padding:.7rem 1rem;border-radius:.4rem;font-weight:600;margin:.8rem 0}
.passed{background:#e3f4e6;color:#14532d}.failed{background:#fde7e7;color:#7f1d1d}
table{border-collapse:collapse;margin:.4rem 0}
td,th{padding:.25rem .8rem;border-bottom:1px solid #d7dde5;text-align:right}
th:first-child,td:first-child,.facts td{text-align:left}.note{color:#55606e;font-size:.9rem}
.wide{overflow-x:auto;margin:.5rem 0}.wide td,.wide th{white-space:nowrap}.chart>div{min-width:720px}
"""


def page(result: Validation) -> str:
    """HTML of a validation.

    Raises
    ------
    CadImplicitError
        If plotly is not installed.
    """
    try:
        from plotly.offline import get_plotlyjs
    except ImportError:
        raise CadImplicitError('the page needs plotly: pip install "cad_implicit[reports]"') from None
    title = f"{result.operation} of {result.part}, {result.radius:g} mm"
    parts = [f"<h1>{html.escape(title)}</h1>", _verdict(result), _summary(result)]
    if result.outcome is not None and result.measured is not None:
        parts += [_regions(result), _solids(result), _histogram(result), _slices(result)]
        if result.levels:
            parts.append(_convergence(result))
    head = '<meta charset="utf-8"><meta name="viewport" content="width=device-width">'
    head += f"<title>{html.escape(title)}</title><style>{_STYLE}</style>"
    script = f"<script>{get_plotlyjs()}</script>"
    return f"<!doctype html><html lang=en><head>{head}{script}</head><body>{''.join(parts)}</body></html>\n"


def _verdict(result: Validation) -> str:
    kind = "passed" if result.passed else "failed"
    text = "Passed" if result.passed else "Failed: " + "; ".join(result.faults)
    return f'<div class="verdict {kind}">{html.escape(text)}</div>'


def _summary(result: Validation) -> str:
    kernel = result.kernel
    rows = [("exact kernel", f"{kernel['fate']}{': ' + kernel['message'] if kernel['message'] else ''}")]
    if result.outcome is not None and result.measured is not None and result.health is not None:
        outcome, health = result.outcome, result.health
        bound = outcome.error_bound
        rows += [
            ("edges", result.edges or "all, by the ball that rolls on the whole part"),
            ("engine, spacing", f"{outcome.engine}, {outcome.spacing:.4g} mm"),
            ("measured against", result.measured.against),
            ("error bound", "none" if bound is None else f"{bound:.4g} mm"),
            ("volume", f"{outcome.before.volume:.6g} → {outcome.mesh.volume:.6g} mm³"),
            ("volume of the exact solid", "–" if kernel["volume"] is None else f"{kernel['volume']:.6g} mm³"),
            ("mesh", f"{len(outcome.mesh.faces)} triangles, {'closed' if health.closed else 'OPEN'}, manifold3d: "
             f"{health.manifold}, {health.self_intersections} self-intersections, {health.slivers} slivers"),
            ("time", f"{sum(outcome.seconds.values()):.2f} s; exact kernel {kernel['seconds']:.2f} s"),
        ]  # fmt: skip
        bends = result.bending
        if bends is not None and bends.samples:
            rows.append(("radius of curvature along the blends", f"{bends.radius:.5g} mm (median; 5 to 95 %: "
                         f"{bends.radius_low:.4g} to {bends.radius_high:.4g} mm)"))  # fmt: skip
        if bends is not None and bends.contacts:
            rows.append(("angle between blends and faces", f"{bends.tangency:.2g}° (median; 95 %: "
                         f"{bends.tangency_high:.2g}°)"))  # fmt: skip
        if result.measured.defect is not None:
            rows.append(("exact kernel's own distance from the balls", f"{result.measured.defect:.3g} mm"))
        rows += [("warning", warning) for warning in outcome.warnings]
    body = "".join(f"<tr><td>{html.escape(a)}</td><td>{html.escape(b)}</td></tr>" for a, b in rows)
    return f'<table class="facts">{body}</table>'


def _regions(result: Validation) -> str:
    assert result.outcome is not None
    h = result.outcome.spacing
    head = "".join(
        f"<th>{name}</th>"
        for name in ("error in mm", "samples", "max", "p99", "RMS", "mean", "bias", "max in h", "max in % of r")
    )
    rows = ""
    for name in ("all", *REGIONS, BY_THE_BALL):
        if name not in result.regions:
            continue
        s = result.regions[name]
        values = [f"{s.samples}", *(f"{v:.2e}" for v in (s.max, s.p99, s.rms, s.mean, s.bias))]
        values += [f"{s.max / h:.3f}", f"{100 * s.max / result.radius:.3f}"]
        label = "all that is judged" if name == "all" else name
        rows += f"<tr><td>{label}</td>{''.join(f'<td>{v}</td>' for v in values)}</tr>"
    return f'<h2>Error by region</h2><div class="wide"><table><tr>{head}</tr>{rows}</table></div>'


def _figure(name: str, figure: Any) -> str:
    return f'<div class="wide chart">{figure.to_html(full_html=False, include_plotlyjs=False, div_id=name)}</div>'


def _solids(result: Validation) -> str:
    """Draw the result, coloured by its error, beside the exact solid."""
    import plotly.graph_objects as go
    from plotly.subplots import make_subplots

    assert result.outcome is not None
    assert result.measured is not None
    mesh, errors = _shown(result.outcome.mesh, result.measured.at_vertices, result.outcome.spacing)
    top = scale_of_colours(errors)
    others = [] if result.measured.exact is None else [result.measured.exact]
    titles = ["result, error in mm", *(["exact kernel"] if others else [])]
    figure = make_subplots(
        cols=len(titles), specs=[[{"type": "scene"}] * len(titles)], subplot_titles=titles, horizontal_spacing=0.02
    )
    figure.add_trace(_trace(go, mesh, errors, top), row=1, col=1)
    for other in others:
        coarse, _ = _shown(other, np.zeros(len(other.vertices)), result.outcome.spacing)
        figure.add_trace(_trace(go, coarse, None, top), row=1, col=2)
    limits = {"99.9 %": top, "error bound": result.outcome.error_bound or top, "spacing": result.outcome.spacing}
    buttons = [
        {
            "label": f"colours ±{value:.2g} mm ({name})",
            "method": "restyle",
            "args": [{"cmin": -value, "cmax": value}, [0]],
        }
        for name, value in limits.items()
    ]
    figure.update_layout(
        height=620, margin={"l": 0, "r": 0, "t": 60, "b": 0},
        updatemenus=[{"buttons": buttons, "x": 0.0, "y": 1.12, "xanchor": "left"}],
    )  # fmt: skip
    for number in range(1, len(titles) + 1):
        figure.update_layout({f"scene{number if number > 1 else ''}": {"aspectmode": "data"}})
    note = '<p class="note">Drag to turn. Red: too much material, blue: too little; grey: not measured.</p>'
    return "<h2>In 3-D</h2>" + _figure("solids", figure) + note


def scale_of_colours(errors: FloatArray) -> float:
    """Largest error in mm of the colours: that of 99.9 % of the vertices."""
    return max(float(np.nanpercentile(np.abs(errors), 99.9)) if np.isfinite(errors).any() else 0.0, 1e-12)


def _trace(go: Any, mesh: Mesh, errors: FloatArray | None, top: float) -> Any:
    x, y, z = np.round(mesh.vertices, 5).T
    i, j, k = mesh.faces.T
    shape = {"x": x, "y": y, "z": z, "i": i, "j": j, "k": k, "flatshading": True}
    # By default triangles that are small beside the picture have no normals, and are dark.
    light = {"ambient": 0.55, "diffuse": 0.7, "specular": 0.15, "roughness": 0.6, "facenormalsepsilon": 0.0}
    if errors is None:
        return go.Mesh3d(**shape, color="#b9c4d0", lighting=light, hoverinfo="skip")
    return go.Mesh3d(
        **shape, intensity=np.nan_to_num(errors), colorscale=_SCALE, cmin=-top, cmax=top, lighting=light,
        colorbar={"title": "mm", "len": 0.8}, hovertemplate="%{intensity:.3e} mm<extra></extra>",
    )  # fmt: skip


def _shown(mesh: Mesh, values: FloatArray, spacing: float) -> tuple[Mesh, FloatArray]:
    """Mesh with values at its vertices, simplified if it is large."""
    if len(mesh.faces) <= _MOST:
        return mesh, values
    coarse = simplify(mesh, _COARSE * spacing)
    return coarse, values[cKDTree(mesh.vertices).query(coarse.vertices)[1]]


def _histogram(result: Validation) -> str:
    import plotly.graph_objects as go

    assert result.measured is not None
    figure = go.Figure()
    for number, region in enumerate(REGIONS):
        own = result.measured.errors[result.measured.regions == number]
        if len(own):
            counts, edges = np.histogram(own, 80)
            figure.add_trace(go.Bar(x=(edges[1:] + edges[:-1]) / 2, y=counts, name=region, width=np.diff(edges)))
    figure.update_layout(
        height=340, barmode="overlay", margin={"l": 60, "r": 10, "t": 10, "b": 50}, bargap=0,
        xaxis_title="error in mm", yaxis={"type": "log", "title": "samples"},
    )  # fmt: skip
    figure.update_traces(opacity=0.6)
    return "<h2>Histogram</h2>" + _figure("histogram", figure)


def _slices(result: Validation) -> str:
    """Cuts through the place of the largest error, result over exact solid."""
    import plotly.graph_objects as go
    from plotly.subplots import make_subplots

    assert result.outcome is not None
    assert result.measured is not None
    place = place_of_slices(result)
    axes = list(range(3))
    figure = make_subplots(cols=3, subplot_titles=[f"{'xyz'[a]} = {place[a]:.4g} mm" for a in axes])
    shapes = [
        (result.outcome.mesh, "result", "#c2410c"),
        (result.measured.exact or result.outcome.before, "", "#1d4ed8"),
    ]
    names = ["result", "exact kernel" if result.measured.exact is not None else "part before"]
    for axis in axes:
        u, v = [a for a in axes if a != axis]
        for (mesh, _, colour), name in zip(shapes, names, strict=True):
            ends = cut(mesh, axis, float(place[axis]))
            line = np.full((3 * len(ends), 2), np.nan)
            line[0::3], line[1::3] = ends[:, 0][:, [u, v]], ends[:, 1][:, [u, v]]
            figure.add_trace(
                go.Scatter(x=line[:, 0], y=line[:, 1], mode="lines", name=name, legendgroup=name,
                           showlegend=axis == 0, line={"color": colour, "width": 1.2}), row=1, col=axis + 1,
            )  # fmt: skip
        figure.update_yaxes(scaleanchor=f"x{axis + 1 if axis else ''}", row=1, col=axis + 1)
    figure.update_layout(height=400, margin={"l": 40, "r": 10, "t": 40, "b": 40})
    return "<h2>Slices through the place of the largest error</h2>" + _figure("slices", figure)


def place_of_slices(result: Validation) -> FloatArray:
    """Place (3,) of the largest error in mm."""
    assert result.outcome is not None
    return np.array(result.regions["all"].place or result.outcome.mesh.bounds.mean(axis=0))


def cut(mesh: Mesh, axis: int, height: float) -> FloatArray:
    """Segments (N, 2, 3) at which the triangles of a mesh are cut by a plane across an axis."""
    side = mesh.vertices[:, axis] - height
    side = np.where(side == 0, 1e-300, side)
    corners = side[mesh.faces]
    crossing = np.flatnonzero((corners.max(axis=1) > 0) & (corners.min(axis=1) < 0))
    ends = np.zeros((len(crossing), 3, 3))
    hit = np.zeros((len(crossing), 3), np.bool_)
    for corner in range(3):
        a, b = mesh.faces[crossing, corner], mesh.faces[crossing, (corner + 1) % 3]
        hit[:, corner] = side[a] * side[b] < 0
        t = side[a] / np.where(side[a] == side[b], 1.0, side[a] - side[b])
        ends[:, corner] = mesh.vertices[a] + t[:, None] * (mesh.vertices[b] - mesh.vertices[a])
    return np.asarray(ends[hit].reshape(-1, 2, 3))


def _convergence(result: Validation) -> str:
    import plotly.graph_objects as go

    figure = go.Figure()
    for engine in dict.fromkeys(level.engine for level in result.levels):
        own = [level for level in result.levels if level.engine == engine]
        h = [level.spacing for level in own]
        order = result.order.get(engine)
        name = engine if order is None else f"{engine}, order {order:.2f}"
        figure.add_trace(go.Scatter(x=h, y=[level.max for level in own], mode="lines+markers", name=f"{name}: max"))
        figure.add_trace(
            go.Scatter(x=h, y=[level.rms for level in own], mode="lines+markers", name=f"{engine}: RMS",
                       line={"dash": "dot"})
        )  # fmt: skip
    figure.update_layout(
        height=380, margin={"l": 60, "r": 10, "t": 10, "b": 50},
        xaxis={"type": "log", "title": "spacing in mm", "tickvals": sorted({level.spacing for level in result.levels}),
               "tickformat": ".3g"}, yaxis={"type": "log", "title": "error in mm"},
    )  # fmt: skip
    return "<h2>Convergence</h2>" + _figure("convergence", figure)
