"""All edges of a block at half its height: there the exact kernel crashes, in a child process, and nothing is lost."""

import cadquery as cq

import cad_implicit.cadquery  # noqa: F401  (adds the methods)

block = cq.Workplane().box(20, 20, 10)
easy = block.edges().safeFillet(2)
full = block.edges().safeFillet(5, spacing=0.4)
full.export("safe.step")
for name, result in (("2 mm", easy), ("5 mm", full)):
    print(f"{name}: {result.implicit.engine} {result.implicit.reason}")
