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

def apply_coord_boundary_smoothing(
    ms: pymeshlab.MeshSet,
    *,
    wavelength: float | _Value = 0.0,
    rings: int = 3,
    corner_angle: float = 60.0,
    selected: bool = ...,
    max_displacement: float | _Value = 0.0,
    weld: bool = True,
    progress: Callable[[float], object] | None = None,
) -> Report:
    """Boundary Smooth, in place on the current mesh.

    Smooths the boundary of an open surface along itself: jagged rims of scans and of meshes that were cut. Corners
    stay, closed curves do not shrink, and curves without jags are left as they are. A few rings of inner vertices
    follow; the rest of the surface does not move.

    Parameters
    ----------
    wavelength : float, PercentageValue or PureValue, default 0.0
        Wavelength along the boundary at which waves keep half of their height, as a length or a percentage of
        the bounding-box diagonal; shorter ones are removed. 0: 12 mean boundary edges.
    rings : int in [0, 100], default 3
        Rings of inner vertices that follow the boundary. 0: they stay.
    corner_angle : float in [0, 180], default 60.0
        Angle in degrees: where the boundary, seen over a few of its edges, turns by more, it has a corner that
        stays. 180: no corners.
    selected : bool, default whether something is selected
        Moves only selected vertices of the boundary and those of selected faces. Default: on if anything is
        selected.
    max_displacement : float, PercentageValue or PureValue, default 0.0
        Limit of the distance that a vertex may move, as a length or a percentage of the bounding-box diagonal.
        Vertices around those that reach it follow, so that no kinks appear; the report counts those that reach
        it. 0: no limit.
    weld : bool, default True
        Coincident vertices, as along texture seams and in triangle soups, move as one. Off: they are separate
        vertices, and the surface has a boundary there.
    """

def apply_coord_edge_aware_smoothing(
    ms: pymeshlab.MeshSet,
    *,
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
    max_displacement: float | _Value = 0.0,
    weld: bool = True,
    progress: Callable[[float], object] | None = None,
) -> Report:
    """Edge-Aware Smooth, in place on the current mesh.

    Smooths the surface and keeps its edges: low-passes the face normals on the graph of faces, with weights that
    decrease across edges, and fits the vertices to them. Parameters that are not given are chosen by the estimated
    error.

    Parameters
    ----------
    strength : float in [0, 1000], default 0.0
        Strength of the low-pass of the normals: 0.1 is weak; 2 to 6 suits sharp edges and strong noise. 0:
        chosen by estimated error.
    range_sigma : float in [0, 2], default 0.0
        Difference of unit normals that is considered an edge: 0.2 for sharp edges, 0.6 for organic shapes. 0:
        chosen by estimated error.
    iterations : int in [0, 100], default 0
        Number of times that the normals are filtered and the vertices fitted to them. 0: chosen by estimated
        error.
    start : auto | given | smoothed, default auto
        Surface that the first iteration filters: the given one, for sharp edges, or the isotropically smoothed
        one, for organic shapes. auto: chosen by estimated error; the given one if strength, range sigma and
        iterations are given.
    barycenter_weight : float in [0, 1000], default 0.0
        Barycenter weight of the isotropic filter, whose result guides the first iteration or is its start. 0:
        chosen by the noise.
    boundary : free | fixed | curve | auto, default auto
        Boundary of an open surface: free treats it like the interior, which may draw it inward; fixed leaves it
        exactly unchanged, so that adjacent tiles still fit; curve smooths it as a curve. auto fits it to the
        normals of its faces without drawing it inward.
    selected : bool, default whether something is selected
        Moves only selected vertices and those of selected faces; the effect fades out toward the others.
        Default: on if anything is selected, unless the selection marks features.
    features : none | vertex_selection | face_selection | vertex_quality, default none
        Vertices with detail to be kept or enhanced: the selected ones, those of selected faces, or all,
        weighted by their quality from 0 to 1.
    feature_gain : float in [0, 100], default 1.0
        Fraction of the displacement that is withheld from features: 0 smooths them like the other vertices, 1
        leaves them unchanged, values above 1 enhance their detail.
    creases : none | edge_selection, default none
        Edges across which nothing is smoothed: the selected ones, e.g. by compute_selection_crease_per_edge.
        Faces on opposite sides do not affect each other's normals.
    crease_angle : float in [0, 180], default 0.0
        Instead of a selection: edges whose adjacent face normals differ by more than this angle, in degrees
        below 180, are creases; on noisy meshes the normals after a first edge-aware low-pass are compared. 0:
        none.
    max_displacement : float, PercentageValue or PureValue, default 0.0
        Limit of the distance that a vertex may move, as a length or a percentage of the bounding-box diagonal.
        Vertices around those that reach it follow, so that no kinks appear; the report counts those that reach
        it. 0: no limit.
    weld : bool, default True
        Coincident vertices, as along texture seams and in triangle soups, move as one. Off: they are separate
        vertices, and the surface has a boundary there.
    """

def apply_coord_spectral_denoising(
    ms: pymeshlab.MeshSet,
    *,
    spacing: float = 0.0,
    slice_spacing: float = 0.0,
    boundary: Literal["free", "fixed", "curve", "auto"] = "auto",
    selected: bool = ...,
    features: Literal["none", "vertex_selection", "face_selection", "vertex_quality"] = "none",
    feature_gain: float = 1.0,
    creases: Literal["none", "edge_selection"] = "none",
    crease_angle: float = 0.0,
    max_displacement: float | _Value = 0.0,
    weld: bool = True,
    progress: Callable[[float], object] | None = None,
) -> Report:
    """Spectral Denoise, in place on the current mesh.

    Removes noise and keeps the shape, without any parameter: measures the noise, tries the isotropic filter and
    several settings of the edge-aware one, and returns the result of least estimated error.

    Parameters
    ----------
    spacing : float from 0, default 0.0
        Side of the voxels, in mesh units, if the surface was made from a binary mask: it is then smoothed as
        far as nearly all vertices stay within about half a voxel of where they were. 0: voxels are recognized
        where the mesh is unchanged but for its position, orientation and scale.
    slice_spacing : float from 0, default 0.0
        Side of the voxels along z, where it differs from the spacing, as the distance of the slices of a scan.
        0: the same.
    boundary : free | fixed | curve | auto, default auto
        Boundary of an open surface: free treats it like the interior, which may draw it inward; fixed leaves it
        exactly unchanged, so that adjacent tiles still fit; curve smooths it as a curve. auto fits it to the
        normals of its faces without drawing it inward.
    selected : bool, default whether something is selected
        Moves only selected vertices and those of selected faces; the effect fades out toward the others.
        Default: on if anything is selected, unless the selection marks features.
    features : none | vertex_selection | face_selection | vertex_quality, default none
        Vertices with detail to be kept or enhanced: the selected ones, those of selected faces, or all,
        weighted by their quality from 0 to 1.
    feature_gain : float in [0, 100], default 1.0
        Fraction of the displacement that is withheld from features: 0 smooths them like the other vertices, 1
        leaves them unchanged, values above 1 enhance their detail.
    creases : none | edge_selection, default none
        Edges across which nothing is smoothed: the selected ones, e.g. by compute_selection_crease_per_edge.
        Faces on opposite sides do not affect each other's normals.
    crease_angle : float in [0, 180], default 0.0
        Instead of a selection: edges whose adjacent face normals differ by more than this angle, in degrees
        below 180, are creases; on noisy meshes the normals after a first edge-aware low-pass are compared. 0:
        none.
    max_displacement : float, PercentageValue or PureValue, default 0.0
        Limit of the distance that a vertex may move, as a length or a percentage of the bounding-box diagonal.
        Vertices around those that reach it follow, so that no kinks appear; the report counts those that reach
        it. 0: no limit.
    weld : bool, default True
        Coincident vertices, as along texture seams and in triangle soups, move as one. Off: they are separate
        vertices, and the surface has a boundary there.
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
    tolerance: float = 0.003,
    boundary: Literal["free", "fixed", "curve"] = "fixed",
    selected: bool = ...,
    features: Literal["none", "vertex_selection", "face_selection", "vertex_quality"] = "none",
    max_displacement: float | _Value = 0.0,
    weld: bool = True,
    progress: Callable[[float], object] | None = None,
) -> Report:
    """Spectral Enhance, in place on the current mesh.

    Amplifies the surface detail between two wavelengths, on the whole mesh or on marked features: the same three
    steps as Spectral Smooth, with a band amplified instead of removed.

    Parameters
    ----------
    longest : float, PercentageValue or PureValue, default 0.0
        Longest wavelength enhanced, as a length or a percentage of the bounding-box diagonal. 0: 30 mean edge
        lengths.
    shortest : float, PercentageValue or PureValue, default 0.0
        Shortest wavelength enhanced, as a length or a percentage of the bounding-box diagonal. 0: 6 mean edge
        lengths.
    gain : float in [0, 100], default 2.0
        Factor for the differential coordinates of the band: 1 changes nothing, 2 doubles them, 0 removes them.
    response : ideal | butterworth | gaussian | heat, default butterworth
        Response at both ends of the band; all except ideal fall smoothly and are 0.5 there.
    barycenter_weight : float in [0.001, 1000], default 0.1
        Weight of the barycenter constraints. They suppress the enhancement of modes whose eigenvalue is below
        the weight, so it is smaller here than for smoothing.
    laplacian : uniform | cotangent, default uniform
        Weights of the mesh Laplacian: uniform (the paper), or cotangents of the opposite angles, for less
        tangential drift if the triangles are uneven.
    method : auto | exact | chebyshev, default auto
        Method to apply the transfer function: exact computes eigenvectors; chebyshev needs none and is suitable
        for meshes of any size. auto is exact up to 1000 vertices.
    tolerance : float in [1e-10, 0.1], default 0.003
        Relative error of the displacement at which the computation ends. The default does not show; a smaller
        value is for comparisons with a direct solution.
    boundary : free | fixed | curve, default fixed
        Boundary of an open surface: free treats it like the interior, which draws it inward (the paper); fixed
        leaves it unchanged; curve treats it as a curve, for scans with a noisy boundary, and leaves holes
        unchanged whose boundary is shorter than the wavelength.
    selected : bool, default whether something is selected
        Moves only selected vertices and those of selected faces; the effect fades out toward the others.
        Default: on if anything is selected, unless the selection marks features.
    features : none | vertex_selection | face_selection | vertex_quality, default none
        Vertices with detail to be kept or enhanced: the selected ones, those of selected faces, or all,
        weighted by their quality from 0 to 1.
    max_displacement : float, PercentageValue or PureValue, default 0.0
        Limit of the distance that a vertex may move, as a length or a percentage of the bounding-box diagonal.
        Vertices around those that reach it follow, so that no kinks appear; the report counts those that reach
        it. 0: no limit.
    weld : bool, default True
        Coincident vertices, as along texture seams and in triangle soups, move as one. Off: they are separate
        vertices, and the surface has a boundary there.
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
    max_displacement: float | _Value = 0.0,
    weld: bool = True,
    progress: Callable[[float], object] | None = None,
) -> Report:
    """Spectral Low-Pass, in place on the current mesh.

    Low-passes the coordinates themselves in the spectrum of the mesh Laplacian: plain spectral smoothing, which
    removes all detail below the wavelength and shrinks the surface. It is the limit of Spectral Smooth for a
    barycenter weight of 0, and the reference method in the paper.

    Parameters
    ----------
    modes : int from 0, default 0
        Number of spectral modes kept, lowest frequencies first (f_a in the paper). Give this or a wavelength;
        0: the wavelength determines the cut-off.
    wavelength : float, PercentageValue or PureValue, default 0.0
        Shortest wavelength kept, as a length or a percentage of the bounding-box diagonal. 0, and modes 0: 20
        mean edge lengths.
    response : ideal | butterworth | gaussian | heat, default ideal
        Response of the low-pass. ideal (the paper) is 1 below the cut-off and 0 above; the others fall smoothly
        and are 0.5 at the cut-off.
    laplacian : uniform | cotangent, default uniform
        Weights of the mesh Laplacian: uniform (the paper), or cotangents of the opposite angles, for less
        tangential drift if the triangles are uneven.
    method : auto | exact | chebyshev, default auto
        Method to apply the transfer function: exact computes eigenvectors; chebyshev needs none and is suitable
        for meshes of any size. auto is exact up to 1000 vertices.
    mode_count : estimate | exact, default estimate
        Method to convert a number of modes to a cut-off: estimate uses the density of modes, with an error of
        about 2 % from 200 modes on; exact uses a few sparse factorizations. Always exact up to 1000 vertices.
    selected : bool, default whether something is selected
        Moves only selected vertices and those of selected faces; the effect fades out toward the others.
        Default: on if anything is selected.
    max_displacement : float, PercentageValue or PureValue, default 0.0
        Limit of the distance that a vertex may move, as a length or a percentage of the bounding-box diagonal.
        Vertices around those that reach it follow, so that no kinks appear; the report counts those that reach
        it. 0: no limit.
    weld : bool, default True
        Coincident vertices, as along texture seams and in triangle soups, move as one. Off: they are separate
        vertices, and the surface has a boundary there.
    """

def apply_coord_spectral_smoothing(
    ms: pymeshlab.MeshSet,
    *,
    modes: int = 0,
    wavelength: float | _Value = 0.0,
    response: Literal["auto", "ideal", "butterworth", "gaussian", "heat"] = "auto",
    barycenter_weight: float = 0.0,
    spacing: float = 0.0,
    slice_spacing: float = 0.0,
    iterations: int = 1,
    laplacian: Literal["uniform", "cotangent"] = "uniform",
    method: Literal["auto", "exact", "chebyshev"] = "auto",
    mode_count: Literal["estimate", "exact"] = "estimate",
    tolerance: float = 0.003,
    boundary: Literal["free", "fixed", "curve", "auto"] = "auto",
    selected: bool = ...,
    features: Literal["none", "vertex_selection", "face_selection", "vertex_quality"] = "none",
    feature_gain: float = 1.0,
    max_displacement: float | _Value = 0.0,
    weld: bool = True,
    progress: Callable[[float], object] | None = None,
) -> Report:
    """Spectral Smooth, in place on the current mesh.

    Smooths the surface without shrinking it: low-passes the differential coordinates of the vertices in the
    spectrum of the mesh Laplacian, and reconstructs the surface by least squares with constraints on its face
    barycenters. After "Spectral mesh smoothing for virtual simulation".

    Parameters
    ----------
    modes : int from 0, default 0
        Number of spectral modes kept, lowest frequencies first (f_a in the paper). Give this or a wavelength;
        0: the wavelength determines the cut-off.
    wavelength : float, PercentageValue or PureValue, default 0.0
        Shortest wavelength kept, as a length or a percentage of the bounding-box diagonal. 0, and modes 0: 20
        mean edge lengths.
    response : auto | ideal | butterworth | gaussian | heat, default auto
        Response of the low-pass. ideal (the paper) is 1 below the cut-off and 0 above; the others fall smoothly
        and are 0.5 at the cut-off. auto is ideal if a cut-off is given; otherwise heat, or, where the weight is
        chosen on a mesh of at most 100000 vertices, heat or ideal, whichever has the smaller estimated error.
    barycenter_weight : float in [0, 1000], default 0.0
        Weight of the barycenter constraints, which determines the strength of the filter: 1 (the paper) smooths
        gently, 0.3 suits noise of 0.2 edge lengths, smaller values smooth more. 0: the weight of least
        estimated error, for the measured noise.
    spacing : float from 0, default 0.0
        Side of the voxels, in mesh units, if the surface was made from a binary mask: it is then smoothed as
        far as nearly all vertices stay within about half a voxel of where they were. 0: voxels are recognized
        where the mesh is unchanged but for its position, orientation and scale.
    slice_spacing : float from 0, default 0.0
        Side of the voxels along z, where it differs from the spacing, as the distance of the slices of a scan.
        0: the same.
    iterations : int in [1, 1000], default 1
        Number of times that the filter is applied, each time to the previous result.
    laplacian : uniform | cotangent, default uniform
        Weights of the mesh Laplacian: uniform (the paper), or cotangents of the opposite angles, for less
        tangential drift if the triangles are uneven.
    method : auto | exact | chebyshev, default auto
        Method to apply the transfer function: exact computes eigenvectors; chebyshev needs none and is suitable
        for meshes of any size. auto is exact up to 1000 vertices.
    mode_count : estimate | exact, default estimate
        Method to convert a number of modes to a cut-off: estimate uses the density of modes, with an error of
        about 2 % from 200 modes on; exact uses a few sparse factorizations. Always exact up to 1000 vertices.
    tolerance : float in [1e-10, 0.1], default 0.003
        Relative error of the displacement at which the computation ends. The default does not show; a smaller
        value is for comparisons with a direct solution.
    boundary : free | fixed | curve | auto, default auto
        Boundary of an open surface: free treats it like the interior, which draws it inward (the paper); fixed
        leaves it unchanged; curve smooths it as a curve, for scans with a noisy boundary, and leaves holes
        unchanged whose boundary is shorter than the wavelength. auto is fixed, unless the weight is chosen and
        the noise is correlated between neighbors: then the boundary moves along the normals only.
    selected : bool, default whether something is selected
        Moves only selected vertices and those of selected faces; the effect fades out toward the others.
        Default: on if anything is selected, unless the selection marks features.
    features : none | vertex_selection | face_selection | vertex_quality, default none
        Vertices with detail to be kept or enhanced: the selected ones, those of selected faces, or all,
        weighted by their quality from 0 to 1.
    feature_gain : float in [0, 100], default 1.0
        Factor for the detail that smoothing would remove from features: 0 smooths them like the other vertices,
        1 keeps the detail, values above 1 enhance it.
    max_displacement : float, PercentageValue or PureValue, default 0.0
        Limit of the distance that a vertex may move, as a length or a percentage of the bounding-box diagonal.
        Vertices around those that reach it follow, so that no kinks appear; the report counts those that reach
        it. 0: no limit.
    weld : bool, default True
        Coincident vertices, as along texture seams and in triangle soups, move as one. Off: they are separate
        vertices, and the surface has a boundary there.
    """

def compute_scalar_by_estimated_error(
    ms: pymeshlab.MeshSet,
    *,
    after: Literal["denoising", "smoothing"] = "denoising",
    weld: bool = True,
    progress: Callable[[float], object] | None = None,
) -> Report:
    """Estimated Error, in place on the current mesh.

    Sets the vertex quality to the error that is expected around each vertex after automatic denoising or smoothing,
    along the normals, in mesh units: where the result can be trusted. It is estimated without ground truth. The
    mesh does not move.

    Parameters
    ----------
    after : denoising | smoothing, default denoising
        Filter whose error is estimated: Spectral Denoise, or Spectral Smooth, both without parameters.
    weld : bool, default True
        Coincident vertices, as along texture seams and in triangle soups, move as one. Off: they are separate
        vertices, and the surface has a boundary there.
    """

def compute_scalar_by_noise_level(
    ms: pymeshlab.MeshSet,
    *,
    unit: Literal["mesh", "edges"] = "mesh",
    weld: bool = True,
    progress: Callable[[float], object] | None = None,
) -> Report:
    """Noise Level, in place on the current mesh.

    Sets the vertex quality to the level of the noise around each vertex, by which the automatic filters smooth: its
    standard deviation along the normals, without the detail of the shape. The mesh does not move.

    Parameters
    ----------
    unit : mesh | edges, default mesh
        Unit of the level: mesh units, or mean edge lengths of the mesh.
    weld : bool, default True
        Coincident vertices, as along texture seams and in triangle soups, move as one. Off: they are separate
        vertices, and the surface has a boundary there.
    """

def compute_scalar_by_spectral_displacement(
    ms: pymeshlab.MeshSet,
    *,
    modes: int = 0,
    wavelength: float | _Value = 0.0,
    response: Literal["auto", "ideal", "butterworth", "gaussian", "heat"] = "auto",
    barycenter_weight: float = 0.0,
    spacing: float = 0.0,
    slice_spacing: float = 0.0,
    iterations: int = 1,
    laplacian: Literal["uniform", "cotangent"] = "uniform",
    method: Literal["auto", "exact", "chebyshev"] = "auto",
    mode_count: Literal["estimate", "exact"] = "estimate",
    tolerance: float = 0.003,
    boundary: Literal["free", "fixed", "curve", "auto"] = "auto",
    weld: bool = True,
    progress: Callable[[float], object] | None = None,
) -> Report:
    """Spectral Displacement, in place on the current mesh.

    Sets the vertex quality to the displacement of each vertex along its normal by Spectral Smooth, in mesh units,
    positive outward: an estimate of the noise, for example to color the mesh by. The mesh does not move. Coincident
    vertices get the mean of their values.

    Parameters
    ----------
    modes : int from 0, default 0
        Number of spectral modes kept, lowest frequencies first (f_a in the paper). Give this or a wavelength;
        0: the wavelength determines the cut-off.
    wavelength : float, PercentageValue or PureValue, default 0.0
        Shortest wavelength kept, as a length or a percentage of the bounding-box diagonal. 0, and modes 0: 20
        mean edge lengths.
    response : auto | ideal | butterworth | gaussian | heat, default auto
        Response of the low-pass. ideal (the paper) is 1 below the cut-off and 0 above; the others fall smoothly
        and are 0.5 at the cut-off. auto is ideal if a cut-off is given; otherwise heat, or, where the weight is
        chosen on a mesh of at most 100000 vertices, heat or ideal, whichever has the smaller estimated error.
    barycenter_weight : float in [0, 1000], default 0.0
        Weight of the barycenter constraints, which determines the strength of the filter: 1 (the paper) smooths
        gently, 0.3 suits noise of 0.2 edge lengths, smaller values smooth more. 0: the weight of least
        estimated error, for the measured noise.
    spacing : float from 0, default 0.0
        Side of the voxels, in mesh units, if the surface was made from a binary mask: it is then smoothed as
        far as nearly all vertices stay within about half a voxel of where they were. 0: voxels are recognized
        where the mesh is unchanged but for its position, orientation and scale.
    slice_spacing : float from 0, default 0.0
        Side of the voxels along z, where it differs from the spacing, as the distance of the slices of a scan.
        0: the same.
    iterations : int in [1, 1000], default 1
        Number of times that the filter is applied, each time to the previous result.
    laplacian : uniform | cotangent, default uniform
        Weights of the mesh Laplacian: uniform (the paper), or cotangents of the opposite angles, for less
        tangential drift if the triangles are uneven.
    method : auto | exact | chebyshev, default auto
        Method to apply the transfer function: exact computes eigenvectors; chebyshev needs none and is suitable
        for meshes of any size. auto is exact up to 1000 vertices.
    mode_count : estimate | exact, default estimate
        Method to convert a number of modes to a cut-off: estimate uses the density of modes, with an error of
        about 2 % from 200 modes on; exact uses a few sparse factorizations. Always exact up to 1000 vertices.
    tolerance : float in [1e-10, 0.1], default 0.003
        Relative error of the displacement at which the computation ends. The default does not show; a smaller
        value is for comparisons with a direct solution.
    boundary : free | fixed | curve | auto, default auto
        Boundary of an open surface: free treats it like the interior, which draws it inward (the paper); fixed
        leaves it unchanged; curve smooths it as a curve, for scans with a noisy boundary, and leaves holes
        unchanged whose boundary is shorter than the wavelength. auto is fixed, unless the weight is chosen and
        the noise is correlated between neighbors: then the boundary moves along the normals only.
    weld : bool, default True
        Coincident vertices, as along texture seams and in triangle soups, move as one. Off: they are separate
        vertices, and the surface has a boundary there.
    """

def get_spectrum(
    ms: pymeshlab.MeshSet,
    *,
    bands: int = 64,
    laplacian: Literal["uniform", "cotangent"] = "uniform",
    progress: Callable[[float], object] | None = None,
) -> Report:
    """Spectrum, in place on the current mesh.

    Measures the spectrum of the current mesh: for each band its eigenvalue, wavelength, number of modes, and power
    of the coordinates and of the differential coordinates; the noise as measured by the filters; and the noise
    floor, which includes fine detail.

    Parameters
    ----------
    bands : int in [2, 4096], default 64
        Number of bands of equal width in frequency; up to 1000 vertices each eigenvalue is a separate band.
    laplacian : uniform | cotangent, default uniform
        Weights of the mesh Laplacian: uniform (the paper), or cotangents of the opposite angles, for less
        tangential drift if the triangles are uneven.
    """

class MeshSet(pymeshlab.MeshSet):  # type: ignore[misc]
    """A pymeshlab MeshSet that knows our filters, without ``register``."""

    def apply_coord_boundary_smoothing(
        self,
        *,
        wavelength: float | _Value = 0.0,
        rings: int = 3,
        corner_angle: float = 60.0,
        selected: bool = ...,
        max_displacement: float | _Value = 0.0,
        weld: bool = True,
        progress: Callable[[float], object] | None = None,
    ) -> Report:
        """Boundary Smooth, in place on the current mesh.

        Smooths the boundary of an open surface along itself: jagged rims of scans and of meshes that were cut. Corners
        stay, closed curves do not shrink, and curves without jags are left as they are. A few rings of inner vertices
        follow; the rest of the surface does not move.

        Parameters
        ----------
        wavelength : float, PercentageValue or PureValue, default 0.0
            Wavelength along the boundary at which waves keep half of their height, as a length or a percentage of
            the bounding-box diagonal; shorter ones are removed. 0: 12 mean boundary edges.
        rings : int in [0, 100], default 3
            Rings of inner vertices that follow the boundary. 0: they stay.
        corner_angle : float in [0, 180], default 60.0
            Angle in degrees: where the boundary, seen over a few of its edges, turns by more, it has a corner that
            stays. 180: no corners.
        selected : bool, default whether something is selected
            Moves only selected vertices of the boundary and those of selected faces. Default: on if anything is
            selected.
        max_displacement : float, PercentageValue or PureValue, default 0.0
            Limit of the distance that a vertex may move, as a length or a percentage of the bounding-box diagonal.
            Vertices around those that reach it follow, so that no kinks appear; the report counts those that reach
            it. 0: no limit.
        weld : bool, default True
            Coincident vertices, as along texture seams and in triangle soups, move as one. Off: they are separate
            vertices, and the surface has a boundary there.
        """

    def apply_coord_edge_aware_smoothing(
        self,
        *,
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
        max_displacement: float | _Value = 0.0,
        weld: bool = True,
        progress: Callable[[float], object] | None = None,
    ) -> Report:
        """Edge-Aware Smooth, in place on the current mesh.

        Smooths the surface and keeps its edges: low-passes the face normals on the graph of faces, with weights that
        decrease across edges, and fits the vertices to them. Parameters that are not given are chosen by the estimated
        error.

        Parameters
        ----------
        strength : float in [0, 1000], default 0.0
            Strength of the low-pass of the normals: 0.1 is weak; 2 to 6 suits sharp edges and strong noise. 0:
            chosen by estimated error.
        range_sigma : float in [0, 2], default 0.0
            Difference of unit normals that is considered an edge: 0.2 for sharp edges, 0.6 for organic shapes. 0:
            chosen by estimated error.
        iterations : int in [0, 100], default 0
            Number of times that the normals are filtered and the vertices fitted to them. 0: chosen by estimated
            error.
        start : auto | given | smoothed, default auto
            Surface that the first iteration filters: the given one, for sharp edges, or the isotropically smoothed
            one, for organic shapes. auto: chosen by estimated error; the given one if strength, range sigma and
            iterations are given.
        barycenter_weight : float in [0, 1000], default 0.0
            Barycenter weight of the isotropic filter, whose result guides the first iteration or is its start. 0:
            chosen by the noise.
        boundary : free | fixed | curve | auto, default auto
            Boundary of an open surface: free treats it like the interior, which may draw it inward; fixed leaves it
            exactly unchanged, so that adjacent tiles still fit; curve smooths it as a curve. auto fits it to the
            normals of its faces without drawing it inward.
        selected : bool, default whether something is selected
            Moves only selected vertices and those of selected faces; the effect fades out toward the others.
            Default: on if anything is selected, unless the selection marks features.
        features : none | vertex_selection | face_selection | vertex_quality, default none
            Vertices with detail to be kept or enhanced: the selected ones, those of selected faces, or all,
            weighted by their quality from 0 to 1.
        feature_gain : float in [0, 100], default 1.0
            Fraction of the displacement that is withheld from features: 0 smooths them like the other vertices, 1
            leaves them unchanged, values above 1 enhance their detail.
        creases : none | edge_selection, default none
            Edges across which nothing is smoothed: the selected ones, e.g. by compute_selection_crease_per_edge.
            Faces on opposite sides do not affect each other's normals.
        crease_angle : float in [0, 180], default 0.0
            Instead of a selection: edges whose adjacent face normals differ by more than this angle, in degrees
            below 180, are creases; on noisy meshes the normals after a first edge-aware low-pass are compared. 0:
            none.
        max_displacement : float, PercentageValue or PureValue, default 0.0
            Limit of the distance that a vertex may move, as a length or a percentage of the bounding-box diagonal.
            Vertices around those that reach it follow, so that no kinks appear; the report counts those that reach
            it. 0: no limit.
        weld : bool, default True
            Coincident vertices, as along texture seams and in triangle soups, move as one. Off: they are separate
            vertices, and the surface has a boundary there.
        """

    def apply_coord_spectral_denoising(
        self,
        *,
        spacing: float = 0.0,
        slice_spacing: float = 0.0,
        boundary: Literal["free", "fixed", "curve", "auto"] = "auto",
        selected: bool = ...,
        features: Literal["none", "vertex_selection", "face_selection", "vertex_quality"] = "none",
        feature_gain: float = 1.0,
        creases: Literal["none", "edge_selection"] = "none",
        crease_angle: float = 0.0,
        max_displacement: float | _Value = 0.0,
        weld: bool = True,
        progress: Callable[[float], object] | None = None,
    ) -> Report:
        """Spectral Denoise, in place on the current mesh.

        Removes noise and keeps the shape, without any parameter: measures the noise, tries the isotropic filter and
        several settings of the edge-aware one, and returns the result of least estimated error.

        Parameters
        ----------
        spacing : float from 0, default 0.0
            Side of the voxels, in mesh units, if the surface was made from a binary mask: it is then smoothed as
            far as nearly all vertices stay within about half a voxel of where they were. 0: voxels are recognized
            where the mesh is unchanged but for its position, orientation and scale.
        slice_spacing : float from 0, default 0.0
            Side of the voxels along z, where it differs from the spacing, as the distance of the slices of a scan.
            0: the same.
        boundary : free | fixed | curve | auto, default auto
            Boundary of an open surface: free treats it like the interior, which may draw it inward; fixed leaves it
            exactly unchanged, so that adjacent tiles still fit; curve smooths it as a curve. auto fits it to the
            normals of its faces without drawing it inward.
        selected : bool, default whether something is selected
            Moves only selected vertices and those of selected faces; the effect fades out toward the others.
            Default: on if anything is selected, unless the selection marks features.
        features : none | vertex_selection | face_selection | vertex_quality, default none
            Vertices with detail to be kept or enhanced: the selected ones, those of selected faces, or all,
            weighted by their quality from 0 to 1.
        feature_gain : float in [0, 100], default 1.0
            Fraction of the displacement that is withheld from features: 0 smooths them like the other vertices, 1
            leaves them unchanged, values above 1 enhance their detail.
        creases : none | edge_selection, default none
            Edges across which nothing is smoothed: the selected ones, e.g. by compute_selection_crease_per_edge.
            Faces on opposite sides do not affect each other's normals.
        crease_angle : float in [0, 180], default 0.0
            Instead of a selection: edges whose adjacent face normals differ by more than this angle, in degrees
            below 180, are creases; on noisy meshes the normals after a first edge-aware low-pass are compared. 0:
            none.
        max_displacement : float, PercentageValue or PureValue, default 0.0
            Limit of the distance that a vertex may move, as a length or a percentage of the bounding-box diagonal.
            Vertices around those that reach it follow, so that no kinks appear; the report counts those that reach
            it. 0: no limit.
        weld : bool, default True
            Coincident vertices, as along texture seams and in triangle soups, move as one. Off: they are separate
            vertices, and the surface has a boundary there.
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
        tolerance: float = 0.003,
        boundary: Literal["free", "fixed", "curve"] = "fixed",
        selected: bool = ...,
        features: Literal["none", "vertex_selection", "face_selection", "vertex_quality"] = "none",
        max_displacement: float | _Value = 0.0,
        weld: bool = True,
        progress: Callable[[float], object] | None = None,
    ) -> Report:
        """Spectral Enhance, in place on the current mesh.

        Amplifies the surface detail between two wavelengths, on the whole mesh or on marked features: the same three
        steps as Spectral Smooth, with a band amplified instead of removed.

        Parameters
        ----------
        longest : float, PercentageValue or PureValue, default 0.0
            Longest wavelength enhanced, as a length or a percentage of the bounding-box diagonal. 0: 30 mean edge
            lengths.
        shortest : float, PercentageValue or PureValue, default 0.0
            Shortest wavelength enhanced, as a length or a percentage of the bounding-box diagonal. 0: 6 mean edge
            lengths.
        gain : float in [0, 100], default 2.0
            Factor for the differential coordinates of the band: 1 changes nothing, 2 doubles them, 0 removes them.
        response : ideal | butterworth | gaussian | heat, default butterworth
            Response at both ends of the band; all except ideal fall smoothly and are 0.5 there.
        barycenter_weight : float in [0.001, 1000], default 0.1
            Weight of the barycenter constraints. They suppress the enhancement of modes whose eigenvalue is below
            the weight, so it is smaller here than for smoothing.
        laplacian : uniform | cotangent, default uniform
            Weights of the mesh Laplacian: uniform (the paper), or cotangents of the opposite angles, for less
            tangential drift if the triangles are uneven.
        method : auto | exact | chebyshev, default auto
            Method to apply the transfer function: exact computes eigenvectors; chebyshev needs none and is suitable
            for meshes of any size. auto is exact up to 1000 vertices.
        tolerance : float in [1e-10, 0.1], default 0.003
            Relative error of the displacement at which the computation ends. The default does not show; a smaller
            value is for comparisons with a direct solution.
        boundary : free | fixed | curve, default fixed
            Boundary of an open surface: free treats it like the interior, which draws it inward (the paper); fixed
            leaves it unchanged; curve treats it as a curve, for scans with a noisy boundary, and leaves holes
            unchanged whose boundary is shorter than the wavelength.
        selected : bool, default whether something is selected
            Moves only selected vertices and those of selected faces; the effect fades out toward the others.
            Default: on if anything is selected, unless the selection marks features.
        features : none | vertex_selection | face_selection | vertex_quality, default none
            Vertices with detail to be kept or enhanced: the selected ones, those of selected faces, or all,
            weighted by their quality from 0 to 1.
        max_displacement : float, PercentageValue or PureValue, default 0.0
            Limit of the distance that a vertex may move, as a length or a percentage of the bounding-box diagonal.
            Vertices around those that reach it follow, so that no kinks appear; the report counts those that reach
            it. 0: no limit.
        weld : bool, default True
            Coincident vertices, as along texture seams and in triangle soups, move as one. Off: they are separate
            vertices, and the surface has a boundary there.
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
        max_displacement: float | _Value = 0.0,
        weld: bool = True,
        progress: Callable[[float], object] | None = None,
    ) -> Report:
        """Spectral Low-Pass, in place on the current mesh.

        Low-passes the coordinates themselves in the spectrum of the mesh Laplacian: plain spectral smoothing, which
        removes all detail below the wavelength and shrinks the surface. It is the limit of Spectral Smooth for a
        barycenter weight of 0, and the reference method in the paper.

        Parameters
        ----------
        modes : int from 0, default 0
            Number of spectral modes kept, lowest frequencies first (f_a in the paper). Give this or a wavelength;
            0: the wavelength determines the cut-off.
        wavelength : float, PercentageValue or PureValue, default 0.0
            Shortest wavelength kept, as a length or a percentage of the bounding-box diagonal. 0, and modes 0: 20
            mean edge lengths.
        response : ideal | butterworth | gaussian | heat, default ideal
            Response of the low-pass. ideal (the paper) is 1 below the cut-off and 0 above; the others fall smoothly
            and are 0.5 at the cut-off.
        laplacian : uniform | cotangent, default uniform
            Weights of the mesh Laplacian: uniform (the paper), or cotangents of the opposite angles, for less
            tangential drift if the triangles are uneven.
        method : auto | exact | chebyshev, default auto
            Method to apply the transfer function: exact computes eigenvectors; chebyshev needs none and is suitable
            for meshes of any size. auto is exact up to 1000 vertices.
        mode_count : estimate | exact, default estimate
            Method to convert a number of modes to a cut-off: estimate uses the density of modes, with an error of
            about 2 % from 200 modes on; exact uses a few sparse factorizations. Always exact up to 1000 vertices.
        selected : bool, default whether something is selected
            Moves only selected vertices and those of selected faces; the effect fades out toward the others.
            Default: on if anything is selected.
        max_displacement : float, PercentageValue or PureValue, default 0.0
            Limit of the distance that a vertex may move, as a length or a percentage of the bounding-box diagonal.
            Vertices around those that reach it follow, so that no kinks appear; the report counts those that reach
            it. 0: no limit.
        weld : bool, default True
            Coincident vertices, as along texture seams and in triangle soups, move as one. Off: they are separate
            vertices, and the surface has a boundary there.
        """

    def apply_coord_spectral_smoothing(
        self,
        *,
        modes: int = 0,
        wavelength: float | _Value = 0.0,
        response: Literal["auto", "ideal", "butterworth", "gaussian", "heat"] = "auto",
        barycenter_weight: float = 0.0,
        spacing: float = 0.0,
        slice_spacing: float = 0.0,
        iterations: int = 1,
        laplacian: Literal["uniform", "cotangent"] = "uniform",
        method: Literal["auto", "exact", "chebyshev"] = "auto",
        mode_count: Literal["estimate", "exact"] = "estimate",
        tolerance: float = 0.003,
        boundary: Literal["free", "fixed", "curve", "auto"] = "auto",
        selected: bool = ...,
        features: Literal["none", "vertex_selection", "face_selection", "vertex_quality"] = "none",
        feature_gain: float = 1.0,
        max_displacement: float | _Value = 0.0,
        weld: bool = True,
        progress: Callable[[float], object] | None = None,
    ) -> Report:
        """Spectral Smooth, in place on the current mesh.

        Smooths the surface without shrinking it: low-passes the differential coordinates of the vertices in the
        spectrum of the mesh Laplacian, and reconstructs the surface by least squares with constraints on its face
        barycenters. After "Spectral mesh smoothing for virtual simulation".

        Parameters
        ----------
        modes : int from 0, default 0
            Number of spectral modes kept, lowest frequencies first (f_a in the paper). Give this or a wavelength;
            0: the wavelength determines the cut-off.
        wavelength : float, PercentageValue or PureValue, default 0.0
            Shortest wavelength kept, as a length or a percentage of the bounding-box diagonal. 0, and modes 0: 20
            mean edge lengths.
        response : auto | ideal | butterworth | gaussian | heat, default auto
            Response of the low-pass. ideal (the paper) is 1 below the cut-off and 0 above; the others fall smoothly
            and are 0.5 at the cut-off. auto is ideal if a cut-off is given; otherwise heat, or, where the weight is
            chosen on a mesh of at most 100000 vertices, heat or ideal, whichever has the smaller estimated error.
        barycenter_weight : float in [0, 1000], default 0.0
            Weight of the barycenter constraints, which determines the strength of the filter: 1 (the paper) smooths
            gently, 0.3 suits noise of 0.2 edge lengths, smaller values smooth more. 0: the weight of least
            estimated error, for the measured noise.
        spacing : float from 0, default 0.0
            Side of the voxels, in mesh units, if the surface was made from a binary mask: it is then smoothed as
            far as nearly all vertices stay within about half a voxel of where they were. 0: voxels are recognized
            where the mesh is unchanged but for its position, orientation and scale.
        slice_spacing : float from 0, default 0.0
            Side of the voxels along z, where it differs from the spacing, as the distance of the slices of a scan.
            0: the same.
        iterations : int in [1, 1000], default 1
            Number of times that the filter is applied, each time to the previous result.
        laplacian : uniform | cotangent, default uniform
            Weights of the mesh Laplacian: uniform (the paper), or cotangents of the opposite angles, for less
            tangential drift if the triangles are uneven.
        method : auto | exact | chebyshev, default auto
            Method to apply the transfer function: exact computes eigenvectors; chebyshev needs none and is suitable
            for meshes of any size. auto is exact up to 1000 vertices.
        mode_count : estimate | exact, default estimate
            Method to convert a number of modes to a cut-off: estimate uses the density of modes, with an error of
            about 2 % from 200 modes on; exact uses a few sparse factorizations. Always exact up to 1000 vertices.
        tolerance : float in [1e-10, 0.1], default 0.003
            Relative error of the displacement at which the computation ends. The default does not show; a smaller
            value is for comparisons with a direct solution.
        boundary : free | fixed | curve | auto, default auto
            Boundary of an open surface: free treats it like the interior, which draws it inward (the paper); fixed
            leaves it unchanged; curve smooths it as a curve, for scans with a noisy boundary, and leaves holes
            unchanged whose boundary is shorter than the wavelength. auto is fixed, unless the weight is chosen and
            the noise is correlated between neighbors: then the boundary moves along the normals only.
        selected : bool, default whether something is selected
            Moves only selected vertices and those of selected faces; the effect fades out toward the others.
            Default: on if anything is selected, unless the selection marks features.
        features : none | vertex_selection | face_selection | vertex_quality, default none
            Vertices with detail to be kept or enhanced: the selected ones, those of selected faces, or all,
            weighted by their quality from 0 to 1.
        feature_gain : float in [0, 100], default 1.0
            Factor for the detail that smoothing would remove from features: 0 smooths them like the other vertices,
            1 keeps the detail, values above 1 enhance it.
        max_displacement : float, PercentageValue or PureValue, default 0.0
            Limit of the distance that a vertex may move, as a length or a percentage of the bounding-box diagonal.
            Vertices around those that reach it follow, so that no kinks appear; the report counts those that reach
            it. 0: no limit.
        weld : bool, default True
            Coincident vertices, as along texture seams and in triangle soups, move as one. Off: they are separate
            vertices, and the surface has a boundary there.
        """

    def compute_scalar_by_estimated_error(
        self,
        *,
        after: Literal["denoising", "smoothing"] = "denoising",
        weld: bool = True,
        progress: Callable[[float], object] | None = None,
    ) -> Report:
        """Estimated Error, in place on the current mesh.

        Sets the vertex quality to the error that is expected around each vertex after automatic denoising or smoothing,
        along the normals, in mesh units: where the result can be trusted. It is estimated without ground truth. The
        mesh does not move.

        Parameters
        ----------
        after : denoising | smoothing, default denoising
            Filter whose error is estimated: Spectral Denoise, or Spectral Smooth, both without parameters.
        weld : bool, default True
            Coincident vertices, as along texture seams and in triangle soups, move as one. Off: they are separate
            vertices, and the surface has a boundary there.
        """

    def compute_scalar_by_noise_level(
        self,
        *,
        unit: Literal["mesh", "edges"] = "mesh",
        weld: bool = True,
        progress: Callable[[float], object] | None = None,
    ) -> Report:
        """Noise Level, in place on the current mesh.

        Sets the vertex quality to the level of the noise around each vertex, by which the automatic filters smooth: its
        standard deviation along the normals, without the detail of the shape. The mesh does not move.

        Parameters
        ----------
        unit : mesh | edges, default mesh
            Unit of the level: mesh units, or mean edge lengths of the mesh.
        weld : bool, default True
            Coincident vertices, as along texture seams and in triangle soups, move as one. Off: they are separate
            vertices, and the surface has a boundary there.
        """

    def compute_scalar_by_spectral_displacement(
        self,
        *,
        modes: int = 0,
        wavelength: float | _Value = 0.0,
        response: Literal["auto", "ideal", "butterworth", "gaussian", "heat"] = "auto",
        barycenter_weight: float = 0.0,
        spacing: float = 0.0,
        slice_spacing: float = 0.0,
        iterations: int = 1,
        laplacian: Literal["uniform", "cotangent"] = "uniform",
        method: Literal["auto", "exact", "chebyshev"] = "auto",
        mode_count: Literal["estimate", "exact"] = "estimate",
        tolerance: float = 0.003,
        boundary: Literal["free", "fixed", "curve", "auto"] = "auto",
        weld: bool = True,
        progress: Callable[[float], object] | None = None,
    ) -> Report:
        """Spectral Displacement, in place on the current mesh.

        Sets the vertex quality to the displacement of each vertex along its normal by Spectral Smooth, in mesh units,
        positive outward: an estimate of the noise, for example to color the mesh by. The mesh does not move. Coincident
        vertices get the mean of their values.

        Parameters
        ----------
        modes : int from 0, default 0
            Number of spectral modes kept, lowest frequencies first (f_a in the paper). Give this or a wavelength;
            0: the wavelength determines the cut-off.
        wavelength : float, PercentageValue or PureValue, default 0.0
            Shortest wavelength kept, as a length or a percentage of the bounding-box diagonal. 0, and modes 0: 20
            mean edge lengths.
        response : auto | ideal | butterworth | gaussian | heat, default auto
            Response of the low-pass. ideal (the paper) is 1 below the cut-off and 0 above; the others fall smoothly
            and are 0.5 at the cut-off. auto is ideal if a cut-off is given; otherwise heat, or, where the weight is
            chosen on a mesh of at most 100000 vertices, heat or ideal, whichever has the smaller estimated error.
        barycenter_weight : float in [0, 1000], default 0.0
            Weight of the barycenter constraints, which determines the strength of the filter: 1 (the paper) smooths
            gently, 0.3 suits noise of 0.2 edge lengths, smaller values smooth more. 0: the weight of least
            estimated error, for the measured noise.
        spacing : float from 0, default 0.0
            Side of the voxels, in mesh units, if the surface was made from a binary mask: it is then smoothed as
            far as nearly all vertices stay within about half a voxel of where they were. 0: voxels are recognized
            where the mesh is unchanged but for its position, orientation and scale.
        slice_spacing : float from 0, default 0.0
            Side of the voxels along z, where it differs from the spacing, as the distance of the slices of a scan.
            0: the same.
        iterations : int in [1, 1000], default 1
            Number of times that the filter is applied, each time to the previous result.
        laplacian : uniform | cotangent, default uniform
            Weights of the mesh Laplacian: uniform (the paper), or cotangents of the opposite angles, for less
            tangential drift if the triangles are uneven.
        method : auto | exact | chebyshev, default auto
            Method to apply the transfer function: exact computes eigenvectors; chebyshev needs none and is suitable
            for meshes of any size. auto is exact up to 1000 vertices.
        mode_count : estimate | exact, default estimate
            Method to convert a number of modes to a cut-off: estimate uses the density of modes, with an error of
            about 2 % from 200 modes on; exact uses a few sparse factorizations. Always exact up to 1000 vertices.
        tolerance : float in [1e-10, 0.1], default 0.003
            Relative error of the displacement at which the computation ends. The default does not show; a smaller
            value is for comparisons with a direct solution.
        boundary : free | fixed | curve | auto, default auto
            Boundary of an open surface: free treats it like the interior, which draws it inward (the paper); fixed
            leaves it unchanged; curve smooths it as a curve, for scans with a noisy boundary, and leaves holes
            unchanged whose boundary is shorter than the wavelength. auto is fixed, unless the weight is chosen and
            the noise is correlated between neighbors: then the boundary moves along the normals only.
        weld : bool, default True
            Coincident vertices, as along texture seams and in triangle soups, move as one. Off: they are separate
            vertices, and the surface has a boundary there.
        """

    def get_spectrum(
        self,
        *,
        bands: int = 64,
        laplacian: Literal["uniform", "cotangent"] = "uniform",
        progress: Callable[[float], object] | None = None,
    ) -> Report:
        """Spectrum, in place on the current mesh.

        Measures the spectrum of the current mesh: for each band its eigenvalue, wavelength, number of modes, and power
        of the coordinates and of the differential coordinates; the noise as measured by the filters; and the noise
        floor, which includes fine detail.

        Parameters
        ----------
        bands : int in [2, 4096], default 64
            Number of bands of equal width in frequency; up to 1000 vertices each eigenvalue is a separate band.
        laplacian : uniform | cotangent, default uniform
            Weights of the mesh Laplacian: uniform (the paper), or cotangents of the opposite angles, for less
            tangential drift if the triangles are uneven.
        """
