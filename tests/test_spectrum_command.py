"""``specsmooth spectrum``: figures that agree with the function's, a plot where there is an extra for it."""

import csv
import json
import sys

import numpy as np
import pytest

import meshlab_specsmooth as mss
from meshlab_specsmooth.cli import main
from meshlab_specsmooth.meshlab import mesh_files, meshset
from meshlab_specsmooth.operators.reconstruction import transfer_function
from tests.meshes import rough, torus, torus_graph


@pytest.fixture(params=[(20, 12), (60, 40)], ids=["exact", "moments"])
def scan(tmp_path, request):
    path = tmp_path / "scan.ply"
    mesh_files.write(meshset.new(*rough(torus(*request.param))), path)
    return path


def test_the_files_hold_what_the_function_measures(scan, tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["spectrum", str(scan), "--out", str(out), "--bands", "16", "--modes", "40"]) == 0
    expected = mss.spectrum(*meshset.get_arrays(mesh_files.read(scan)), bands=16)
    whole = json.loads((out / "spectrum.json").read_text(encoding="utf-8"))
    assert whole["noise_floor"] == expected.noise_floor
    assert whole["method"] == expected.method
    assert whole["bands"]["eigenvalue"] == expected.eigenvalue.tolist()
    finite = np.isfinite(expected.wavelength)
    assert [x is not None for x in whole["bands"]["wavelength"]] == finite.tolist()
    kept = round(whole["filter"]["modes"])
    assert kept in {40, 41}  # waves round and across a torus come in pairs, which stay together
    with (out / "spectrum.csv").open(encoding="utf-8", newline="") as lines:
        rows = list(csv.DictReader(lines))
    assert [float(row["coordinate_power"]) for row in rows] == expected.coordinate_power.tolist()
    assert [float(row["wavelength"]) for row in rows] == expected.wavelength.tolist()
    assert (out / "spectrum.png").read_bytes().startswith(b"\x89PNG")
    printed = capsys.readouterr()
    assert f"noise floor {expected.noise_floor:.3g} a coordinate" in printed.out
    assert f"{kept} modes" in printed.out
    assert printed.err == ""


def test_without_the_extra_the_data_is_written_and_the_extra_named(scan, tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    assert main(["spectrum", str(scan), "--out", str(tmp_path / "out")]) == 0
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["spectrum.csv", "spectrum.json"]
    assert "report" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["--bands", "1"], 2, "integer from 2 to 4096"),
        (["--modes", "3", "--wavelength", "1"], 2, "modes and wavelength"),
        (["--response", "box"], 2, "invalid choice"),
    ],
)
def test_wrong_usage_is_one_line(scan, tmp_path, capsys, arguments, code, words):
    try:
        given = main(["spectrum", str(scan), "--out", str(tmp_path / "out"), *arguments])
    except SystemExit as end:  # argparse's own
        given = end.code
    assert given == code
    assert words in capsys.readouterr().err


def test_coincident_points_have_no_spectrum(tmp_path, capsys):
    path = tmp_path / "point.ply"
    mesh_files.write(meshset.new(np.ones((2400, 3)), torus_graph(60, 40)), path)
    assert main(["spectrum", str(path), "--out", str(tmp_path)]) == 2
    assert capsys.readouterr().err == "specsmooth: a mesh without edges has no spectrum\n"


def test_the_transfer_function_is_the_effect_on_an_eigenvector():
    nx = ny = 24
    F = torus_graph(nx, ny)
    S = np.asarray(
        mss.assemble(np.zeros((nx * ny, 3)) + np.eye(3)[0], F, weld=False).L.graph.symmetric_laplacian().toarray()
    )
    values, waves = np.linalg.eigh(S)
    for k in (5, 100, 400):
        V = np.outer(waves[:, k], [1.0, 2.0, 0.5])
        weight, cutoff = 0.4, 0.9 * values[k]
        wavelength = np.pi / np.sqrt(cutoff) * mss.assemble(V, F, weld=False).mean_edge
        wavelength *= 2.0 ** mss.assemble(V, F, weld=False).exponent
        result = mss.smooth(V, F, wavelength=wavelength, response="heat", barycenter_weight=weight, weld=False)
        gain = np.exp2(-values[k] / result.cutoff)
        expected = transfer_function(np.array([values[k]]), np.array([gain]), weight)[0]
        assert result.vertices == pytest.approx(expected * V, abs=2e-3 * abs(V).max())
