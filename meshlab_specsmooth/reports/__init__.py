"""Pictures, plots and pages: the only package that imports a renderer."""
