"""Find out and suppress what a MeshSet prints."""

from __future__ import annotations

import contextlib
import io

import pymeshlab

from meshlab_specsmooth.meshlab import native_output
from meshlab_specsmooth.meshlab.filter_script import preserve_script
from meshlab_specsmooth.meshlab.records import Verbosity, state_of
from meshlab_specsmooth.runtime.interrupts import DeferInterrupts

# pymeshlab's own methods: the wrapped ones change the known verbosity
_NATIVE_VERBOSITY = pymeshlab.MeshSet.set_verbosity
_NATIVE_PARAMETER_VERBOSITY = pymeshlab.MeshSet.set_parameter_verbosity


def verbosity_of(ms: pymeshlab.MeshSet) -> Verbosity:
    """Return what a MeshSet prints; it must have a mesh.

    pymeshlab has no getter, so at the first call a filter without effect is run and its output examined.
    """
    state = state_of(ms)
    if state.verbosity is None:
        with DeferInterrupts(), preserve_script(ms):
            state.verbosity = _probe(ms)
    return state.verbosity


def silence(ms: pymeshlab.MeshSet, known: Verbosity) -> None:
    """Print nothing until :func:`restore`."""
    if any(known):
        _NATIVE_VERBOSITY(ms, False)
        _NATIVE_PARAMETER_VERBOSITY(ms, False)


def restore(ms: pymeshlab.MeshSet, known: Verbosity) -> None:
    """Set the verbosity again that :func:`silence` switched off."""
    if any(known):
        _NATIVE_VERBOSITY(ms, known.everything)
        _NATIVE_PARAMETER_VERBOSITY(ms, known.parameters)


def _probe(ms: pymeshlab.MeshSet) -> Verbosity:
    printed = _output_of_a_filter(ms)
    if not printed:
        return Verbosity(False, False)
    _NATIVE_VERBOSITY(ms, False)
    parameters = _output_of_a_filter(ms)
    # full verbosity prints the parameters as well, and one more line
    everything = printed.count("\n") > parameters.count("\n")
    _NATIVE_VERBOSITY(ms, everything)
    return Verbosity(everything, bool(parameters))


def _output_of_a_filter(ms: pymeshlab.MeshSet) -> str:
    """Return what a filter without effect prints, from C++ and through Python.

    Both are needed: pymeshlab redirects C++'s streams for the whole process while a filter runs, and if several threads
    run filters at once, they may stay redirected.
    """
    printed = io.StringIO()
    with native_output.capture() as captured, contextlib.redirect_stdout(printed):
        ms.set_selection_none(allfaces=False, allverts=False)
    return captured[0] + printed.getvalue()
