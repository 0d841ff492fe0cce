"""Numba kernels: they see arrays and scalars only, and import nothing but numpy, numba and math."""
