"""The names that parameters take, as types: for those who check theirs. What is taken at run time is checked there."""

from __future__ import annotations

from typing import Literal

Response = Literal["ideal", "butterworth", "gaussian", "heat"]
AnyResponse = Literal["auto", "ideal", "butterworth", "gaussian", "heat"]
Criterion = Literal["position", "normals"]
LaplacianKind = Literal["uniform", "cotangent"]
Method = Literal["auto", "exact", "chebyshev"]
ModeCount = Literal["estimate", "exact"]
Boundary = Literal["auto", "fixed", "curve", "free"]
Start = Literal["auto", "given", "smoothed"]
