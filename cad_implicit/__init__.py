"""cad_implicit: the fillet that never fails."""
