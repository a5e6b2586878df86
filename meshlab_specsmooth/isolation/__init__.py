"""Processes of their own, for work that may crash."""
