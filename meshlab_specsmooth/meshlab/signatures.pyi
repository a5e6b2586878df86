"""The filters on MeshSets and their parameters, for type checkers and editors.

Made from the descriptors in ``filters_xml/`` by ``python3 scripts/make_docs.py``.
"""

from collections.abc import Callable
from typing import Literal, Protocol

import pymeshlab

from meshlab_specsmooth.describe import Report

class _Value(Protocol):
    """pymeshlab's PercentageValue (of the bounding-box diagonal) and PureValue."""

    def value(self) -> float: ...

def apply_coord_edge_aware_smoothing(
    ms: pymeshlab.MeshSet,
    *,
    criterion: Literal["position", "normals"] = "position",
    strength: float = 0.0,
    range_sigma: float = 0.0,
    iterations: int = 0,
    start: Literal["auto", "given", "smoothed"] = "auto",
    barycenter_weight: float = 0.0,
    boundary: Literal["free", "fixed", "curve", "auto"] = "auto",
    selected: bool = ...,
    features: Literal["none", "vertex_selection", "face_selection", "vertex_quality"] = "none",
    feature_gain: float = 1.0,
    creases: Literal["none", "edge_selection"] = "none",
    crease_angle: float = 0.0,
    weld: bool = True,
    progress: Callable[[float], object] | None = None,
) -> Report:
    """Edge-Aware Smooth, in place on the current mesh.

    Smooths the surface and keeps its edges: low-passes the face normals on the graph of faces, with weights that
    fall across creases, and lets the vertices follow. What is not given is chosen by the estimated error, so that
    it needs no parameter.

    Parameters
    ----------
    criterion : position | normals, default position
        Whether the error of positions is to be least, or rather that of the normals: then the noise is taken
        for higher.
    strength : float in [0, 1000], default 0.0
        Strength of the low-pass of the normals: 0.1 is gentle, 2 to 6 suits hard edges under much noise. 0:
        chosen by estimated error.
    range_sigma : float in [0, 2], default 0.0
        Difference of unit normals that counts as an edge: 0.2 for hard edges, 0.6 for organic shapes. 0: chosen
        by estimated error.
    iterations : int in [0, 100], default 0
        How often normals are filtered and vertices follow. 0: chosen by estimated error.
    start : auto | given | smoothed, default auto
        What the first pass filters: the surface as given, for hard edges, or the isotropically smoothed one,
        for organic shapes. auto: chosen by estimated error; as given where strength, range sigma and iterations
        are given.
    barycenter_weight : float in [0, 1000], default 0.0
        How firmly the isotropic filter, which the first pass is guided by or starts from, holds the face
        barycenters. 0: chosen by the noise.
    boundary : free | fixed | curve | auto, default auto
        What happens at the boundary of an open surface: free treats it like the rest, which may draw it inward,
        fixed leaves it to the bit, so that tiles with a common edge still fit, curve smooths it along itself.
        auto: it follows the normals of its faces, and is not drawn inward.
    selected : bool, default whether something is selected
        Moves only selected vertices and those of selected faces; the effect fades out toward the others.
        Default: on when something is selected, unless the selection marks features.
    features : none | vertex_selection | face_selection | vertex_quality, default none
        Which vertices carry detail to be kept or enhanced: the selected ones, those of selected faces, or each
        to the degree of its quality, a weight from 0 to 1.
    feature_gain : float in [0, 100], default 1.0
        What features keep of the displacement that smoothing asks for: 0 smooths them as the rest, 1 keeps them
        where they are, above 1 enhances their detail.
    creases : none | edge_selection, default none
        Edges that nothing crosses: those that are selected, as by compute_selection_crease_per_edge. Faces on
        their opposite sides exchange no normals.
    crease_angle : float in [0, 180], default 0.0
        In place of a selection of edges: all edges whose faces' normals differ by more than this angle in
        degrees are creases; under noise it is the normals after a first edge-aware low-pass that are compared.
        0: none, below 180.
    weld : bool, default True
        Vertices that lie at one place, as along texture seams and in triangle soups, move as one. Off: each
        copy is a vertex of its own, and the surface ends at its edges.
    """

def apply_coord_spectral_denoising(
    ms: pymeshlab.MeshSet,
    *,
    criterion: Literal["position", "normals"] = "position",
    boundary: Literal["free", "fixed", "curve", "auto"] = "auto",
    selected: bool = ...,
    features: Literal["none", "vertex_selection", "face_selection", "vertex_quality"] = "none",
    feature_gain: float = 1.0,
    creases: Literal["none", "edge_selection"] = "none",
    crease_angle: float = 0.0,
    weld: bool = True,
    progress: Callable[[float], object] | None = None,
) -> Report:
    """Spectral Denoise, in place on the current mesh.

    Removes noise and keeps shape, without a parameter: measures the noise, tries the isotropic filter and settings
    of the edge-aware one, and takes what has the least estimated error.

    Parameters
    ----------
    criterion : position | normals, default position
        Whether the error of positions is to be least, or rather that of the normals: then the noise is taken
        for higher.
    boundary : free | fixed | curve | auto, default auto
        What happens at the boundary of an open surface: free treats it like the rest, which may draw it inward,
        fixed leaves it to the bit, so that tiles with a common edge still fit, curve smooths it along itself.
        auto: it follows the normals of its faces, and is not drawn inward.
    selected : bool, default whether something is selected
        Moves only selected vertices and those of selected faces; the effect fades out toward the others.
        Default: on when something is selected, unless the selection marks features.
    features : none | vertex_selection | face_selection | vertex_quality, default none
        Which vertices carry detail to be kept or enhanced: the selected ones, those of selected faces, or each
        to the degree of its quality, a weight from 0 to 1.
    feature_gain : float in [0, 100], default 1.0
        What features keep of the displacement that smoothing asks for: 0 smooths them as the rest, 1 keeps them
        where they are, above 1 enhances their detail.
    creases : none | edge_selection, default none
        Edges that nothing crosses: those that are selected, as by compute_selection_crease_per_edge. Faces on
        their opposite sides exchange no normals.
    crease_angle : float in [0, 180], default 0.0
        In place of a selection of edges: all edges whose faces' normals differ by more than this angle in
        degrees are creases; under noise it is the normals after a first edge-aware low-pass that are compared.
        0: none, below 180.
    weld : bool, default True
        Vertices that lie at one place, as along texture seams and in triangle soups, move as one. Off: each
        copy is a vertex of its own, and the surface ends at its edges.
    """

def apply_coord_spectral_enhancement(
    ms: pymeshlab.MeshSet,
    *,
    longest: float | _Value = 0.0,
    shortest: float | _Value = 0.0,
    gain: float = 2.0,
    response: Literal["ideal", "butterworth", "gaussian", "heat"] = "butterworth",
    barycenter_weight: float = 0.1,
    laplacian: Literal["uniform", "cotangent"] = "uniform",
    method: Literal["auto", "exact", "chebyshev"] = "auto",
    boundary: Literal["free", "fixed", "curve"] = "fixed",
    selected: bool = ...,
    features: Literal["none", "vertex_selection", "face_selection", "vertex_quality"] = "none",
    weld: bool = True,
    progress: Callable[[float], object] | None = None,
) -> Report:
    """Spectral Enhance, in place on the current mesh.

    Amplifies the surface detail between two wavelengths, or that of marked features: the same three steps as
    Spectral Smooth with a band amplified instead of removed.

    Parameters
    ----------
    longest : float, PercentageValue or PureValue, default 0.0
        Longest surface wave enhanced, as a length or a percentage of the bounding-box diagonal. 0: waves of 30
        mean edge lengths.
    shortest : float, PercentageValue or PureValue, default 0.0
        Shortest surface wave enhanced, as a length or a percentage of the bounding-box diagonal. 0: waves of 6
        mean edge lengths.
    gain : float in [0, 100], default 2.0
        What the band's differential coordinates are multiplied with: 1 changes nothing, 2 doubles them, 0
        removes them.
    response : ideal | butterworth | gaussian | heat, default butterworth
        Shape of the two ends of the band; all but ideal fall smoothly and have a half at the end.
    barycenter_weight : float in [0.001, 1000], default 0.1
        How firmly the face barycenters are held. They hold back waves whose eigenvalue is below the weight, so
        it is smaller here than for smoothing.
    laplacian : uniform | cotangent, default uniform
        Weights of the mesh Laplacian: uniform (the paper), or cotangents of the opposite angles, which drift
        less along the surface of uneven triangles.
    method : auto | exact | chebyshev, default auto
        How the transfer function is applied: exact computes eigenvectors, chebyshev needs none and takes meshes
        of any size. auto is exact up to 1000 vertices.
    boundary : free | fixed | curve, default fixed
        What happens at the boundary of an open surface: free treats it like the rest, which draws it inward
        (the paper), fixed leaves it, curve treats it as a curve by itself, for scans with noise at their rim;
        holes that are shorter round than the wavelength stay.
    selected : bool, default whether something is selected
        Moves only selected vertices and those of selected faces; the effect fades out toward the others.
        Default: on when something is selected, unless the selection marks features.
    features : none | vertex_selection | face_selection | vertex_quality, default none
        Which vertices carry detail to be kept or enhanced: the selected ones, those of selected faces, or each
        to the degree of its quality, a weight from 0 to 1.
    weld : bool, default True
        Vertices that lie at one place, as along texture seams and in triangle soups, move as one. Off: each
        copy is a vertex of its own, and the surface ends at its edges.
    """

def apply_coord_spectral_low_pass(
    ms: pymeshlab.MeshSet,
    *,
    modes: int = 0,
    wavelength: float | _Value = 0.0,
    response: Literal["ideal", "butterworth", "gaussian", "heat"] = "ideal",
    laplacian: Literal["uniform", "cotangent"] = "uniform",
    method: Literal["auto", "exact", "chebyshev"] = "auto",
    mode_count: Literal["estimate", "exact"] = "estimate",
    selected: bool = ...,
    weld: bool = True,
    progress: Callable[[float], object] | None = None,
) -> Report:
    """Spectral Low-Pass, in place on the current mesh.

    Low-passes the coordinates themselves in the spectrum of the mesh Laplacian: plain spectral smoothing, which
    loses all detail below the wavelength and shrinks. The limit of Spectral Smooth for a barycenter weight of 0,
    and what the paper compares with.

    Parameters
    ----------
    modes : int from 0, default 0
        Number of spectral modes kept, the lowest frequencies first (f_a in the paper). Give this or a
        wavelength; 0 leaves the cut-off to the wavelength.
    wavelength : float, PercentageValue or PureValue, default 0.0
        Shortest surface wave kept, as a length or a percentage of the bounding-box diagonal. 0 with 0 modes:
        waves of 20 mean edge lengths.
    response : ideal | butterworth | gaussian | heat, default ideal
        Shape of the low-pass. ideal is the paper's: all below the cut-off, nothing above. The others fall
        smoothly and keep a half at the cut-off.
    laplacian : uniform | cotangent, default uniform
        Weights of the mesh Laplacian: uniform (the paper), or cotangents of the opposite angles, which drift
        less along the surface of uneven triangles.
    method : auto | exact | chebyshev, default auto
        How the transfer function is applied: exact computes eigenvectors, chebyshev needs none and takes meshes
        of any size. auto is exact up to 1000 vertices.
    mode_count : estimate | exact, default estimate
        How a number of modes becomes a cut-off: estimated from the density of modes, to about 2 % from 200
        modes on, or counted exactly, by a few sparse factorizations. Up to 1000 vertices it is always exact.
    selected : bool, default whether something is selected
        Moves only selected vertices and those of selected faces; the effect fades out toward the others.
        Default: on when something is selected.
    weld : bool, default True
        Vertices that lie at one place, as along texture seams and in triangle soups, move as one. Off: each
        copy is a vertex of its own, and the surface ends at its edges.
    """

def apply_coord_spectral_smoothing(
    ms: pymeshlab.MeshSet,
    *,
    modes: int = 0,
    wavelength: float | _Value = 0.0,
    response: Literal["auto", "ideal", "butterworth", "gaussian", "heat"] = "auto",
    barycenter_weight: float = 0.0,
    criterion: Literal["position", "normals"] = "position",
    iterations: int = 1,
    laplacian: Literal["uniform", "cotangent"] = "uniform",
    method: Literal["auto", "exact", "chebyshev"] = "auto",
    mode_count: Literal["estimate", "exact"] = "estimate",
    boundary: Literal["free", "fixed", "curve", "auto"] = "auto",
    selected: bool = ...,
    features: Literal["none", "vertex_selection", "face_selection", "vertex_quality"] = "none",
    feature_gain: float = 1.0,
    weld: bool = True,
    progress: Callable[[float], object] | None = None,
) -> Report:
    """Spectral Smooth, in place on the current mesh.

    Smooths the surface without shrinking it: takes the differential coordinates of the vertices, low-passes them in
    the spectrum of the mesh Laplacian, and rebuilds the surface by least squares while its face barycenters are
    held in place. After "Spectral mesh smoothing for virtual simulation".

    Parameters
    ----------
    modes : int from 0, default 0
        Number of spectral modes kept, the lowest frequencies first (f_a in the paper). Give this or a
        wavelength; 0 leaves the cut-off to the wavelength.
    wavelength : float, PercentageValue or PureValue, default 0.0
        Shortest surface wave kept, as a length or a percentage of the bounding-box diagonal. 0 with 0 modes:
        waves of 20 mean edge lengths.
    response : auto | ideal | butterworth | gaussian | heat, default auto
        Shape of the low-pass. auto is ideal; where neither cut-off nor weight is given, heat or ideal, by
        estimated error. ideal is the paper's: all below the cut-off, nothing above. The others fall smoothly
        and keep a half at the cut-off.
    barycenter_weight : float in [0, 1000], default 0.0
        How firmly the face barycenters are held, which is the strength of the filter: 1 is the paper and
        smooths gently, 0.3 suits noise of 0.2 edge lengths, less smooths more. 0 measures the noise and takes
        the weight of least estimated error.
    criterion : position | normals, default position
        Whose error is made small where the barycenter weight is chosen: that of the positions, or that of the
        normals, which asks for more smoothing.
    iterations : int in [1, 1000], default 1
        How often the filter is applied, each time to the last result.
    laplacian : uniform | cotangent, default uniform
        Weights of the mesh Laplacian: uniform (the paper), or cotangents of the opposite angles, which drift
        less along the surface of uneven triangles.
    method : auto | exact | chebyshev, default auto
        How the transfer function is applied: exact computes eigenvectors, chebyshev needs none and takes meshes
        of any size. auto is exact up to 1000 vertices.
    mode_count : estimate | exact, default estimate
        How a number of modes becomes a cut-off: estimated from the density of modes, to about 2 % from 200
        modes on, or counted exactly, by a few sparse factorizations. Up to 1000 vertices it is always exact.
    boundary : free | fixed | curve | auto, default auto
        What happens at the boundary of an open surface: free treats it like the rest, which draws it inward
        (the paper), fixed leaves it, curve treats it as a curve by itself, for scans with noise at their rim;
        holes that are shorter round than the wavelength stay. auto is fixed, unless the weight is chosen and
        the noise is shared between neighbors: then the boundary moves across the surface, but not along it.
    selected : bool, default whether something is selected
        Moves only selected vertices and those of selected faces; the effect fades out toward the others.
        Default: on when something is selected, unless the selection marks features.
    features : none | vertex_selection | face_selection | vertex_quality, default none
        Which vertices carry detail to be kept or enhanced: the selected ones, those of selected faces, or each
        to the degree of its quality, a weight from 0 to 1.
    feature_gain : float in [0, 100], default 1.0
        What features keep of the detail that smoothing removes: 0 smooths them as the rest, 1 keeps it, above 1
        enhances it.
    weld : bool, default True
        Vertices that lie at one place, as along texture seams and in triangle soups, move as one. Off: each
        copy is a vertex of its own, and the surface ends at its edges.
    """

def compute_scalar_by_spectral_displacement(
    ms: pymeshlab.MeshSet,
    *,
    modes: int = 0,
    wavelength: float | _Value = 0.0,
    response: Literal["auto", "ideal", "butterworth", "gaussian", "heat"] = "auto",
    barycenter_weight: float = 0.0,
    criterion: Literal["position", "normals"] = "position",
    iterations: int = 1,
    laplacian: Literal["uniform", "cotangent"] = "uniform",
    method: Literal["auto", "exact", "chebyshev"] = "auto",
    mode_count: Literal["estimate", "exact"] = "estimate",
    boundary: Literal["free", "fixed", "curve", "auto"] = "auto",
    weld: bool = True,
    progress: Callable[[float], object] | None = None,
) -> Report:
    """Spectral Displacement, in place on the current mesh.

    Writes into the vertex quality how far Spectral Smooth would move each vertex along its normal, in mesh units,
    outwards positive: the noise that the filter sees, to color and to look at. The mesh does not move. Vertices at
    one place share the mean of theirs.

    Parameters
    ----------
    modes : int from 0, default 0
        Number of spectral modes kept, the lowest frequencies first (f_a in the paper). Give this or a
        wavelength; 0 leaves the cut-off to the wavelength.
    wavelength : float, PercentageValue or PureValue, default 0.0
        Shortest surface wave kept, as a length or a percentage of the bounding-box diagonal. 0 with 0 modes:
        waves of 20 mean edge lengths.
    response : auto | ideal | butterworth | gaussian | heat, default auto
        Shape of the low-pass. auto is ideal; where neither cut-off nor weight is given, heat or ideal, by
        estimated error. ideal is the paper's: all below the cut-off, nothing above. The others fall smoothly
        and keep a half at the cut-off.
    barycenter_weight : float in [0, 1000], default 0.0
        How firmly the face barycenters are held, which is the strength of the filter: 1 is the paper and
        smooths gently, 0.3 suits noise of 0.2 edge lengths, less smooths more. 0 measures the noise and takes
        the weight of least estimated error.
    criterion : position | normals, default position
        Whose error is made small where the barycenter weight is chosen: that of the positions, or that of the
        normals, which asks for more smoothing.
    iterations : int in [1, 1000], default 1
        How often the filter is applied, each time to the last result.
    laplacian : uniform | cotangent, default uniform
        Weights of the mesh Laplacian: uniform (the paper), or cotangents of the opposite angles, which drift
        less along the surface of uneven triangles.
    method : auto | exact | chebyshev, default auto
        How the transfer function is applied: exact computes eigenvectors, chebyshev needs none and takes meshes
        of any size. auto is exact up to 1000 vertices.
    mode_count : estimate | exact, default estimate
        How a number of modes becomes a cut-off: estimated from the density of modes, to about 2 % from 200
        modes on, or counted exactly, by a few sparse factorizations. Up to 1000 vertices it is always exact.
    boundary : free | fixed | curve | auto, default auto
        What happens at the boundary of an open surface: free treats it like the rest, which draws it inward
        (the paper), fixed leaves it, curve treats it as a curve by itself, for scans with noise at their rim;
        holes that are shorter round than the wavelength stay. auto is fixed, unless the weight is chosen and
        the noise is shared between neighbors: then the boundary moves across the surface, but not along it.
    weld : bool, default True
        Vertices that lie at one place, as along texture seams and in triangle soups, move as one. Off: each
        copy is a vertex of its own, and the surface ends at its edges.
    """

def get_spectrum(
    ms: pymeshlab.MeshSet,
    *,
    bands: int = 64,
    laplacian: Literal["uniform", "cotangent"] = "uniform",
    progress: Callable[[float], object] | None = None,
) -> Report:
    """Spectrum, in place on the current mesh.

    Measures the spectrum of the current mesh: eigenvalue, wavelength and number of modes of each band, the power of
    the coordinates and of the differential coordinates in it, the noise as the filters measure it, and the noise
    floor, which counts fine detail as noise.

    Parameters
    ----------
    bands : int in [2, 4096], default 64
        Number of bands that the spectrum is divided into, equally wide in frequency; up to 1000 vertices each
        eigenvalue is a band by itself.
    laplacian : uniform | cotangent, default uniform
        Weights of the mesh Laplacian: uniform (the paper), or cotangents of the opposite angles, which drift
        less along the surface of uneven triangles.
    """

class MeshSet(pymeshlab.MeshSet):  # type: ignore[misc]
    """A pymeshlab MeshSet that knows our filters, without ``register``."""

    def apply_coord_edge_aware_smoothing(
        self,
        *,
        criterion: Literal["position", "normals"] = "position",
        strength: float = 0.0,
        range_sigma: float = 0.0,
        iterations: int = 0,
        start: Literal["auto", "given", "smoothed"] = "auto",
        barycenter_weight: float = 0.0,
        boundary: Literal["free", "fixed", "curve", "auto"] = "auto",
        selected: bool = ...,
        features: Literal["none", "vertex_selection", "face_selection", "vertex_quality"] = "none",
        feature_gain: float = 1.0,
        creases: Literal["none", "edge_selection"] = "none",
        crease_angle: float = 0.0,
        weld: bool = True,
        progress: Callable[[float], object] | None = None,
    ) -> Report:
        """Edge-Aware Smooth, in place on the current mesh.

        Smooths the surface and keeps its edges: low-passes the face normals on the graph of faces, with weights that
        fall across creases, and lets the vertices follow. What is not given is chosen by the estimated error, so that
        it needs no parameter.

        Parameters
        ----------
        criterion : position | normals, default position
            Whether the error of positions is to be least, or rather that of the normals: then the noise is taken
            for higher.
        strength : float in [0, 1000], default 0.0
            Strength of the low-pass of the normals: 0.1 is gentle, 2 to 6 suits hard edges under much noise. 0:
            chosen by estimated error.
        range_sigma : float in [0, 2], default 0.0
            Difference of unit normals that counts as an edge: 0.2 for hard edges, 0.6 for organic shapes. 0: chosen
            by estimated error.
        iterations : int in [0, 100], default 0
            How often normals are filtered and vertices follow. 0: chosen by estimated error.
        start : auto | given | smoothed, default auto
            What the first pass filters: the surface as given, for hard edges, or the isotropically smoothed one,
            for organic shapes. auto: chosen by estimated error; as given where strength, range sigma and iterations
            are given.
        barycenter_weight : float in [0, 1000], default 0.0
            How firmly the isotropic filter, which the first pass is guided by or starts from, holds the face
            barycenters. 0: chosen by the noise.
        boundary : free | fixed | curve | auto, default auto
            What happens at the boundary of an open surface: free treats it like the rest, which may draw it inward,
            fixed leaves it to the bit, so that tiles with a common edge still fit, curve smooths it along itself.
            auto: it follows the normals of its faces, and is not drawn inward.
        selected : bool, default whether something is selected
            Moves only selected vertices and those of selected faces; the effect fades out toward the others.
            Default: on when something is selected, unless the selection marks features.
        features : none | vertex_selection | face_selection | vertex_quality, default none
            Which vertices carry detail to be kept or enhanced: the selected ones, those of selected faces, or each
            to the degree of its quality, a weight from 0 to 1.
        feature_gain : float in [0, 100], default 1.0
            What features keep of the displacement that smoothing asks for: 0 smooths them as the rest, 1 keeps them
            where they are, above 1 enhances their detail.
        creases : none | edge_selection, default none
            Edges that nothing crosses: those that are selected, as by compute_selection_crease_per_edge. Faces on
            their opposite sides exchange no normals.
        crease_angle : float in [0, 180], default 0.0
            In place of a selection of edges: all edges whose faces' normals differ by more than this angle in
            degrees are creases; under noise it is the normals after a first edge-aware low-pass that are compared.
            0: none, below 180.
        weld : bool, default True
            Vertices that lie at one place, as along texture seams and in triangle soups, move as one. Off: each
            copy is a vertex of its own, and the surface ends at its edges.
        """

    def apply_coord_spectral_denoising(
        self,
        *,
        criterion: Literal["position", "normals"] = "position",
        boundary: Literal["free", "fixed", "curve", "auto"] = "auto",
        selected: bool = ...,
        features: Literal["none", "vertex_selection", "face_selection", "vertex_quality"] = "none",
        feature_gain: float = 1.0,
        creases: Literal["none", "edge_selection"] = "none",
        crease_angle: float = 0.0,
        weld: bool = True,
        progress: Callable[[float], object] | None = None,
    ) -> Report:
        """Spectral Denoise, in place on the current mesh.

        Removes noise and keeps shape, without a parameter: measures the noise, tries the isotropic filter and settings
        of the edge-aware one, and takes what has the least estimated error.

        Parameters
        ----------
        criterion : position | normals, default position
            Whether the error of positions is to be least, or rather that of the normals: then the noise is taken
            for higher.
        boundary : free | fixed | curve | auto, default auto
            What happens at the boundary of an open surface: free treats it like the rest, which may draw it inward,
            fixed leaves it to the bit, so that tiles with a common edge still fit, curve smooths it along itself.
            auto: it follows the normals of its faces, and is not drawn inward.
        selected : bool, default whether something is selected
            Moves only selected vertices and those of selected faces; the effect fades out toward the others.
            Default: on when something is selected, unless the selection marks features.
        features : none | vertex_selection | face_selection | vertex_quality, default none
            Which vertices carry detail to be kept or enhanced: the selected ones, those of selected faces, or each
            to the degree of its quality, a weight from 0 to 1.
        feature_gain : float in [0, 100], default 1.0
            What features keep of the displacement that smoothing asks for: 0 smooths them as the rest, 1 keeps them
            where they are, above 1 enhances their detail.
        creases : none | edge_selection, default none
            Edges that nothing crosses: those that are selected, as by compute_selection_crease_per_edge. Faces on
            their opposite sides exchange no normals.
        crease_angle : float in [0, 180], default 0.0
            In place of a selection of edges: all edges whose faces' normals differ by more than this angle in
            degrees are creases; under noise it is the normals after a first edge-aware low-pass that are compared.
            0: none, below 180.
        weld : bool, default True
            Vertices that lie at one place, as along texture seams and in triangle soups, move as one. Off: each
            copy is a vertex of its own, and the surface ends at its edges.
        """

    def apply_coord_spectral_enhancement(
        self,
        *,
        longest: float | _Value = 0.0,
        shortest: float | _Value = 0.0,
        gain: float = 2.0,
        response: Literal["ideal", "butterworth", "gaussian", "heat"] = "butterworth",
        barycenter_weight: float = 0.1,
        laplacian: Literal["uniform", "cotangent"] = "uniform",
        method: Literal["auto", "exact", "chebyshev"] = "auto",
        boundary: Literal["free", "fixed", "curve"] = "fixed",
        selected: bool = ...,
        features: Literal["none", "vertex_selection", "face_selection", "vertex_quality"] = "none",
        weld: bool = True,
        progress: Callable[[float], object] | None = None,
    ) -> Report:
        """Spectral Enhance, in place on the current mesh.

        Amplifies the surface detail between two wavelengths, or that of marked features: the same three steps as
        Spectral Smooth with a band amplified instead of removed.

        Parameters
        ----------
        longest : float, PercentageValue or PureValue, default 0.0
            Longest surface wave enhanced, as a length or a percentage of the bounding-box diagonal. 0: waves of 30
            mean edge lengths.
        shortest : float, PercentageValue or PureValue, default 0.0
            Shortest surface wave enhanced, as a length or a percentage of the bounding-box diagonal. 0: waves of 6
            mean edge lengths.
        gain : float in [0, 100], default 2.0
            What the band's differential coordinates are multiplied with: 1 changes nothing, 2 doubles them, 0
            removes them.
        response : ideal | butterworth | gaussian | heat, default butterworth
            Shape of the two ends of the band; all but ideal fall smoothly and have a half at the end.
        barycenter_weight : float in [0.001, 1000], default 0.1
            How firmly the face barycenters are held. They hold back waves whose eigenvalue is below the weight, so
            it is smaller here than for smoothing.
        laplacian : uniform | cotangent, default uniform
            Weights of the mesh Laplacian: uniform (the paper), or cotangents of the opposite angles, which drift
            less along the surface of uneven triangles.
        method : auto | exact | chebyshev, default auto
            How the transfer function is applied: exact computes eigenvectors, chebyshev needs none and takes meshes
            of any size. auto is exact up to 1000 vertices.
        boundary : free | fixed | curve, default fixed
            What happens at the boundary of an open surface: free treats it like the rest, which draws it inward
            (the paper), fixed leaves it, curve treats it as a curve by itself, for scans with noise at their rim;
            holes that are shorter round than the wavelength stay.
        selected : bool, default whether something is selected
            Moves only selected vertices and those of selected faces; the effect fades out toward the others.
            Default: on when something is selected, unless the selection marks features.
        features : none | vertex_selection | face_selection | vertex_quality, default none
            Which vertices carry detail to be kept or enhanced: the selected ones, those of selected faces, or each
            to the degree of its quality, a weight from 0 to 1.
        weld : bool, default True
            Vertices that lie at one place, as along texture seams and in triangle soups, move as one. Off: each
            copy is a vertex of its own, and the surface ends at its edges.
        """

    def apply_coord_spectral_low_pass(
        self,
        *,
        modes: int = 0,
        wavelength: float | _Value = 0.0,
        response: Literal["ideal", "butterworth", "gaussian", "heat"] = "ideal",
        laplacian: Literal["uniform", "cotangent"] = "uniform",
        method: Literal["auto", "exact", "chebyshev"] = "auto",
        mode_count: Literal["estimate", "exact"] = "estimate",
        selected: bool = ...,
        weld: bool = True,
        progress: Callable[[float], object] | None = None,
    ) -> Report:
        """Spectral Low-Pass, in place on the current mesh.

        Low-passes the coordinates themselves in the spectrum of the mesh Laplacian: plain spectral smoothing, which
        loses all detail below the wavelength and shrinks. The limit of Spectral Smooth for a barycenter weight of 0,
        and what the paper compares with.

        Parameters
        ----------
        modes : int from 0, default 0
            Number of spectral modes kept, the lowest frequencies first (f_a in the paper). Give this or a
            wavelength; 0 leaves the cut-off to the wavelength.
        wavelength : float, PercentageValue or PureValue, default 0.0
            Shortest surface wave kept, as a length or a percentage of the bounding-box diagonal. 0 with 0 modes:
            waves of 20 mean edge lengths.
        response : ideal | butterworth | gaussian | heat, default ideal
            Shape of the low-pass. ideal is the paper's: all below the cut-off, nothing above. The others fall
            smoothly and keep a half at the cut-off.
        laplacian : uniform | cotangent, default uniform
            Weights of the mesh Laplacian: uniform (the paper), or cotangents of the opposite angles, which drift
            less along the surface of uneven triangles.
        method : auto | exact | chebyshev, default auto
            How the transfer function is applied: exact computes eigenvectors, chebyshev needs none and takes meshes
            of any size. auto is exact up to 1000 vertices.
        mode_count : estimate | exact, default estimate
            How a number of modes becomes a cut-off: estimated from the density of modes, to about 2 % from 200
            modes on, or counted exactly, by a few sparse factorizations. Up to 1000 vertices it is always exact.
        selected : bool, default whether something is selected
            Moves only selected vertices and those of selected faces; the effect fades out toward the others.
            Default: on when something is selected.
        weld : bool, default True
            Vertices that lie at one place, as along texture seams and in triangle soups, move as one. Off: each
            copy is a vertex of its own, and the surface ends at its edges.
        """

    def apply_coord_spectral_smoothing(
        self,
        *,
        modes: int = 0,
        wavelength: float | _Value = 0.0,
        response: Literal["auto", "ideal", "butterworth", "gaussian", "heat"] = "auto",
        barycenter_weight: float = 0.0,
        criterion: Literal["position", "normals"] = "position",
        iterations: int = 1,
        laplacian: Literal["uniform", "cotangent"] = "uniform",
        method: Literal["auto", "exact", "chebyshev"] = "auto",
        mode_count: Literal["estimate", "exact"] = "estimate",
        boundary: Literal["free", "fixed", "curve", "auto"] = "auto",
        selected: bool = ...,
        features: Literal["none", "vertex_selection", "face_selection", "vertex_quality"] = "none",
        feature_gain: float = 1.0,
        weld: bool = True,
        progress: Callable[[float], object] | None = None,
    ) -> Report:
        """Spectral Smooth, in place on the current mesh.

        Smooths the surface without shrinking it: takes the differential coordinates of the vertices, low-passes them in
        the spectrum of the mesh Laplacian, and rebuilds the surface by least squares while its face barycenters are
        held in place. After "Spectral mesh smoothing for virtual simulation".

        Parameters
        ----------
        modes : int from 0, default 0
            Number of spectral modes kept, the lowest frequencies first (f_a in the paper). Give this or a
            wavelength; 0 leaves the cut-off to the wavelength.
        wavelength : float, PercentageValue or PureValue, default 0.0
            Shortest surface wave kept, as a length or a percentage of the bounding-box diagonal. 0 with 0 modes:
            waves of 20 mean edge lengths.
        response : auto | ideal | butterworth | gaussian | heat, default auto
            Shape of the low-pass. auto is ideal; where neither cut-off nor weight is given, heat or ideal, by
            estimated error. ideal is the paper's: all below the cut-off, nothing above. The others fall smoothly
            and keep a half at the cut-off.
        barycenter_weight : float in [0, 1000], default 0.0
            How firmly the face barycenters are held, which is the strength of the filter: 1 is the paper and
            smooths gently, 0.3 suits noise of 0.2 edge lengths, less smooths more. 0 measures the noise and takes
            the weight of least estimated error.
        criterion : position | normals, default position
            Whose error is made small where the barycenter weight is chosen: that of the positions, or that of the
            normals, which asks for more smoothing.
        iterations : int in [1, 1000], default 1
            How often the filter is applied, each time to the last result.
        laplacian : uniform | cotangent, default uniform
            Weights of the mesh Laplacian: uniform (the paper), or cotangents of the opposite angles, which drift
            less along the surface of uneven triangles.
        method : auto | exact | chebyshev, default auto
            How the transfer function is applied: exact computes eigenvectors, chebyshev needs none and takes meshes
            of any size. auto is exact up to 1000 vertices.
        mode_count : estimate | exact, default estimate
            How a number of modes becomes a cut-off: estimated from the density of modes, to about 2 % from 200
            modes on, or counted exactly, by a few sparse factorizations. Up to 1000 vertices it is always exact.
        boundary : free | fixed | curve | auto, default auto
            What happens at the boundary of an open surface: free treats it like the rest, which draws it inward
            (the paper), fixed leaves it, curve treats it as a curve by itself, for scans with noise at their rim;
            holes that are shorter round than the wavelength stay. auto is fixed, unless the weight is chosen and
            the noise is shared between neighbors: then the boundary moves across the surface, but not along it.
        selected : bool, default whether something is selected
            Moves only selected vertices and those of selected faces; the effect fades out toward the others.
            Default: on when something is selected, unless the selection marks features.
        features : none | vertex_selection | face_selection | vertex_quality, default none
            Which vertices carry detail to be kept or enhanced: the selected ones, those of selected faces, or each
            to the degree of its quality, a weight from 0 to 1.
        feature_gain : float in [0, 100], default 1.0
            What features keep of the detail that smoothing removes: 0 smooths them as the rest, 1 keeps it, above 1
            enhances it.
        weld : bool, default True
            Vertices that lie at one place, as along texture seams and in triangle soups, move as one. Off: each
            copy is a vertex of its own, and the surface ends at its edges.
        """

    def compute_scalar_by_spectral_displacement(
        self,
        *,
        modes: int = 0,
        wavelength: float | _Value = 0.0,
        response: Literal["auto", "ideal", "butterworth", "gaussian", "heat"] = "auto",
        barycenter_weight: float = 0.0,
        criterion: Literal["position", "normals"] = "position",
        iterations: int = 1,
        laplacian: Literal["uniform", "cotangent"] = "uniform",
        method: Literal["auto", "exact", "chebyshev"] = "auto",
        mode_count: Literal["estimate", "exact"] = "estimate",
        boundary: Literal["free", "fixed", "curve", "auto"] = "auto",
        weld: bool = True,
        progress: Callable[[float], object] | None = None,
    ) -> Report:
        """Spectral Displacement, in place on the current mesh.

        Writes into the vertex quality how far Spectral Smooth would move each vertex along its normal, in mesh units,
        outwards positive: the noise that the filter sees, to color and to look at. The mesh does not move. Vertices at
        one place share the mean of theirs.

        Parameters
        ----------
        modes : int from 0, default 0
            Number of spectral modes kept, the lowest frequencies first (f_a in the paper). Give this or a
            wavelength; 0 leaves the cut-off to the wavelength.
        wavelength : float, PercentageValue or PureValue, default 0.0
            Shortest surface wave kept, as a length or a percentage of the bounding-box diagonal. 0 with 0 modes:
            waves of 20 mean edge lengths.
        response : auto | ideal | butterworth | gaussian | heat, default auto
            Shape of the low-pass. auto is ideal; where neither cut-off nor weight is given, heat or ideal, by
            estimated error. ideal is the paper's: all below the cut-off, nothing above. The others fall smoothly
            and keep a half at the cut-off.
        barycenter_weight : float in [0, 1000], default 0.0
            How firmly the face barycenters are held, which is the strength of the filter: 1 is the paper and
            smooths gently, 0.3 suits noise of 0.2 edge lengths, less smooths more. 0 measures the noise and takes
            the weight of least estimated error.
        criterion : position | normals, default position
            Whose error is made small where the barycenter weight is chosen: that of the positions, or that of the
            normals, which asks for more smoothing.
        iterations : int in [1, 1000], default 1
            How often the filter is applied, each time to the last result.
        laplacian : uniform | cotangent, default uniform
            Weights of the mesh Laplacian: uniform (the paper), or cotangents of the opposite angles, which drift
            less along the surface of uneven triangles.
        method : auto | exact | chebyshev, default auto
            How the transfer function is applied: exact computes eigenvectors, chebyshev needs none and takes meshes
            of any size. auto is exact up to 1000 vertices.
        mode_count : estimate | exact, default estimate
            How a number of modes becomes a cut-off: estimated from the density of modes, to about 2 % from 200
            modes on, or counted exactly, by a few sparse factorizations. Up to 1000 vertices it is always exact.
        boundary : free | fixed | curve | auto, default auto
            What happens at the boundary of an open surface: free treats it like the rest, which draws it inward
            (the paper), fixed leaves it, curve treats it as a curve by itself, for scans with noise at their rim;
            holes that are shorter round than the wavelength stay. auto is fixed, unless the weight is chosen and
            the noise is shared between neighbors: then the boundary moves across the surface, but not along it.
        weld : bool, default True
            Vertices that lie at one place, as along texture seams and in triangle soups, move as one. Off: each
            copy is a vertex of its own, and the surface ends at its edges.
        """

    def get_spectrum(
        self,
        *,
        bands: int = 64,
        laplacian: Literal["uniform", "cotangent"] = "uniform",
        progress: Callable[[float], object] | None = None,
    ) -> Report:
        """Spectrum, in place on the current mesh.

        Measures the spectrum of the current mesh: eigenvalue, wavelength and number of modes of each band, the power of
        the coordinates and of the differential coordinates in it, the noise as the filters measure it, and the noise
        floor, which counts fine detail as noise.

        Parameters
        ----------
        bands : int in [2, 4096], default 64
            Number of bands that the spectrum is divided into, equally wide in frequency; up to 1000 vertices each
            eigenvalue is a band by itself.
        laplacian : uniform | cotangent, default uniform
            Weights of the mesh Laplacian: uniform (the paper), or cotangents of the opposite angles, which drift
            less along the surface of uneven triangles.
        """
