"""``python -m cad_implicit`` is ``cad-implicit``."""

from .cli import main

main()
