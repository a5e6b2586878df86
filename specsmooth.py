"""The command ``specsmooth``, as it is installed."""

from meshlab_specsmooth.__main__ import main

__all__ = ["main"]
