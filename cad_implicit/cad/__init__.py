"""Parts in and out: CadQuery, build123d, OCP shapes, files, arrays."""
