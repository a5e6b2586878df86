"""The surface as arrays, and measures of it."""
