"""A bracket with a large radius in its corner, a small one on the upright edges of its end, and a hole afterwards."""

import cadquery as cq

import cad_implicit.cadquery  # noqa: F401  (adds the methods)

profile = [(0, 0), (40, 0), (40, 6), (6, 6), (6, 30), (0, 30)]
bracket = cq.Workplane("XZ").polyline(profile).close().extrude(-25)
corner = cq.selectors.BoxSelector((5, -1, 5), (7, 26, 7))
bracket = bracket.edges(corner).implicitFillet(8, spacing=0.6).edges("|Z and >X").implicitFillet(4, spacing=0.6)
bracket = bracket.cut(cq.Workplane().center(26, 12.5).circle(3.5).extrude(20))
bracket.export("bracket.step")
print(f"{bracket.val().Volume():.1f} mm³, valid: {bracket.val().isValid()}")
