"""Filters side by side: metrics, and the experiments that use them."""
