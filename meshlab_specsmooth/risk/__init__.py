"""The error of a filter, estimated without ground truth."""
