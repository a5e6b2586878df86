"""Meshes that are larger than memory: cut into pieces with a margin, smoothed one by one, and put together."""
