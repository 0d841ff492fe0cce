"""The tables, figures and examples of the paper, run and set beside its own: ``python -m validation.paper``."""
