"""Types of parameters that take one of several names, for type checkers; values are checked where they are used."""

from __future__ import annotations

from typing import Literal

ResponseName = Literal["ideal", "butterworth", "gaussian", "heat"]
AnyResponseName = Literal["auto", "ideal", "butterworth", "gaussian", "heat"]
LaplacianKind = Literal["uniform", "cotangent"]
Method = Literal["auto", "exact", "chebyshev"]
ModeCount = Literal["estimate", "exact"]
Boundary = Literal["auto", "fixed", "curve", "free"]
Start = Literal["auto", "given", "smoothed"]
