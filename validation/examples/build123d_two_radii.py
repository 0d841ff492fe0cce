"""Two radii in builder mode: the feet of the walls get 3, the upright edges of the base 5."""

from build123d import Axis, Box, BuildPart, Locations, Select, export_step

from cad_implicit.build123d import implicit_fillet

with BuildPart() as cradle:
    Box(50, 30, 6)
    base = cradle.edges().filter_by(Axis.Z)
    with Locations((-12, 0, 10), (12, 0, 10)):
        Box(4, 30, 14)
    feet = [edge for edge in cradle.edges(Select.ALL).filter_by(Axis.Y) if abs(edge.center().Z - 3) < 1e-6]
    feet = [edge for edge in feet if abs(edge.center().X) < 20]
    implicit_fillet(feet, radius=3, spacing=0.6)
    implicit_fillet(cradle.edges().filter_by(Axis.Z).group_by(Axis.X)[-1], radius=5, spacing=0.6)
export_step(cradle.part, "cradle.step")
print(f"{cradle.part.volume:.1f} mm³, valid: {cradle.part.is_valid}")
