"""The paper's three steps on vertices."""
