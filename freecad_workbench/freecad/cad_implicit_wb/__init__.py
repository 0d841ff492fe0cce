"""FreeCAD workbench of cad_implicit: fillets that do not fail, offsets, shells and lattices as parametric features."""
