"""Compare filters on one mesh: metrics, experiments and their results."""
