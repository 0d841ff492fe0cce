"""A hollow box filled with a gyroid, for printing: triangles to 3MF, which knows its unit."""

import cadquery as cq

import cad_implicit as ci

block = cq.Workplane().box(30, 24, 18).edges("|Z").fillet(4)
light = ci.infill(block, cell=9, wall=1.2, skin=1.5, spacing=0.6)
mesh = ci.contour(light)
ci.save(mesh, "light.3mf")
share = mesh.volume / block.val().Volume()
print(f"{len(mesh.faces)} triangles, {share:.0%} of the material")
