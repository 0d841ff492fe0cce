"""A cube rounded until it is a sphere: the exact kernel fails at the last step, r = 5 on a cube of 10."""

from build123d import Box, export_step

from cad_implicit.build123d import implicit_fillet

ball = implicit_fillet(Box(10, 10, 10).edges(), radius=5, spacing=0.6)
export_step(ball, "ball.step")
print(f"{ball.volume:.3f} mm³, a sphere of radius 5 has 523.599; valid: {ball.is_valid}")
