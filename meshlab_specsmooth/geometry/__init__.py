"""The surface as arrays, and what is measured on it."""
