#!/usr/bin/env python3
"""A pymeshlab session as one has it: load, clean, smooth, decimate, measure, save the script, replay it, compare.

python3 scripts/pymeshlab_session.py [--out DIR]
"""

import argparse
import tempfile
from pathlib import Path

import bootstrap

bootstrap.enter("demo")

import numpy as np  # noqa: E402
import pymeshlab  # noqa: E402

import meshlab_specsmooth as mss  # noqa: E402
from meshlab_specsmooth.meshlab.mesh_files import sample  # noqa: E402

NOISE = {"displacement": pymeshlab.PercentageValue(0.15), "randomseed": 1}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", metavar="DIR", type=Path, help="keep what is saved there (default: nowhere)")
    out = parser.parse_args().out
    with tempfile.TemporaryDirectory() as folder:
        session(out or Path(folder))


def session(out: Path) -> None:
    out.mkdir(parents=True, exist_ok=True)
    mss.register()  # from here on our filters are MeshLab's
    ms = pymeshlab.MeshSet()
    ms.load_new_mesh(str(sample("bunny.obj")))
    clean = ms.get_geometric_measures()
    ms.apply_coord_random_displacement(**NOISE)

    ms.clear_filter_script()  # what follows is the recipe
    ms.meshing_remove_duplicate_vertices()
    ms.meshing_remove_unreferenced_vertices()
    ms.apply_coord_spectral_smoothing(barycenter_weight=0.3, wavelength=pymeshlab.PercentageValue(5))
    ms.meshing_decimation_quadric_edge_collapse(targetfacenum=20000)
    ms.compute_scalar_by_spectral_displacement()
    smoothed = ms.get_geometric_measures()

    script, mesh = out / "session.mlx", out / "smoothed.ply"
    ms.save_filter_script(str(script))
    ms.save_current_mesh(str(mesh))
    print(f"volume {clean['mesh_volume']:.6f} -> {smoothed['mesh_volume']:.6f}")
    print(f"area   {clean['surface_area']:.6f} -> {smoothed['surface_area']:.6f}")
    noise = ms.current_mesh().vertex_scalar_array()
    print(f"left for the filter to move: {np.sqrt((noise**2).mean()) / smoothed['avg_edge_length']:.3f} mean edges RMS")

    again = pymeshlab.MeshSet()
    again.load_new_mesh(str(sample("bunny.obj")))
    again.apply_coord_random_displacement(**NOISE)
    again.clear_filter_script()
    again.load_filter_script(str(script))
    again.apply_filter_script()
    same = np.array_equal(again.current_mesh().vertex_matrix(), ms.current_mesh().vertex_matrix())
    print(f"replayed from {script.name}: {'the same to the bit' if same else 'DIFFERENT'}")

    compared = pymeshlab.MeshSet()
    for name, apply in (
        ("ours", lambda m: m.apply_coord_spectral_smoothing(barycenter_weight=0.3)),
        ("Taubin", lambda m: m.apply_coord_taubin_smoothing()),
        ("Laplacian", lambda m: m.apply_coord_laplacian_smoothing()),
    ):
        compared.load_new_mesh(str(sample("bunny.obj")))
        original = compared.current_mesh_id()
        compared.load_new_mesh(str(sample("bunny.obj")))
        compared.apply_coord_random_displacement(**NOISE)
        apply(compared)
        distance = compared.get_hausdorff_distance(sampledmesh=compared.current_mesh_id(), targetmesh=original)
        print(f"{name:10} is {distance['RMS'] / clean['avg_edge_length']:.4f} mean edges from the original (RMS)")
    mss.unregister()


if __name__ == "__main__":
    main()
