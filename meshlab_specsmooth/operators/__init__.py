"""The operators of the paper on a mesh."""
