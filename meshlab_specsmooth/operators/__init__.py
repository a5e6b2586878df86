"""Assemble the operators of the paper on a mesh, and solve for the displacement."""
