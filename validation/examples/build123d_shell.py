"""A housing: carved out to a wall of 2 and open at the bottom, then a hole is drilled; a part of the host all along."""

from build123d import Axis, Box, Cylinder, Pos, Rot, export_step

from cad_implicit.build123d import implicit_shell

block = Box(40, 30, 20) + Pos(0, 0, 10) * Cylinder(8, 8)
housing = implicit_shell(block, amount=-2, openings=block.faces().sort_by(Axis.Z)[0], spacing=0.8)
housing -= Pos(20, 0, 0) * Rot(0, 90, 0) * Cylinder(4, 20)
export_step(housing, "housing.step")
print(f"{housing.volume:.1f} mm³, valid: {housing.is_valid}")
