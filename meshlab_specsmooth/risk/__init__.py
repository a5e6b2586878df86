"""Estimate the error of a filter without ground truth, and choose the weight that minimizes it."""
