"""Estimate and classify the noise of a surface."""
