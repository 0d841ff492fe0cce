"""A remix: an STL from elsewhere is joined with a new stand, the joint is filleted, and it is a solid at the end."""

import trimesh
from build123d import Cylinder, Part, Pos, export_step

import cad_implicit as ci

trimesh.creation.capsule(height=18, radius=6).export("found.stl")  # stands for a model of someone else

figure = ci.to_mesh("found.stl")
stand = ci.to_mesh(Pos(0, 0, -8) * Cylinder(14, 4))
joined = ci.MeshDistance(figure) | ci.MeshDistance(stand)
mesh = ci.contour(ci.fillet(joined, 3, spacing=0.7))
ci.save(mesh, "remix.stl")
remix = Part(ci.to_part(mesh, tolerance=0.05).wrapped)
export_step(remix - Pos(0, 0, -10) * Cylinder(2, 12), "remix.step")
print(f"{len(mesh.faces)} triangles, {len(remix.faces())} faces, valid: {remix.is_valid}")
