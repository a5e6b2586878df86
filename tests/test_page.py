"""The page in a real browser: headless Chromium, driven by Playwright."""

import json
import os
import re
import shutil

import numpy as np
import pymeshlab
import pytest

import meshlab_specsmooth as mss
from meshlab_specsmooth.geometry.decimate import cluster_vertices
from meshlab_specsmooth.reports import export
from tests.meshes import rough, sheet, torus

sync_api = pytest.importorskip("playwright.sync_api")
pyvista = pytest.importorskip("pyvista")
CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
without_chromium = pytest.mark.skipif(
    CHROMIUM is None,
    reason="no Chromium here; scripts/test.py installs it where it may, else: apt-get install chromium",
)


def in_a_browser(test):
    """A test of what the browser runs, of which no line is Python's."""
    return pytest.mark.no_cover(without_chromium(test))


FILTERS = ["taubin", "automatic", "compute_mls_projection_apss"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("comparison")
    mss.compare(mss.Surface(*torus(40, 24)), noise=0.2, filters=FILTERS, out=place, name="a <torus> & more")
    return place


@pytest.fixture(scope="module")
def browser():
    with sync_api.sync_playwright() as playwright:
        # WebGL by SwiftShader, on the processor
        flags = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]
        if hasattr(os, "geteuid") and os.geteuid() == 0:
            flags.append("--no-sandbox")
        started = playwright.chromium.launch(executable_path=CHROMIUM, args=flags)
        yield started
        started.close()


@pytest.fixture
def opened(browser, folder):
    """The page in a window, with what it said and what it asked for."""
    window = browser.new_page(viewport={"width": 1400, "height": 1000})
    window.said, window.requests = [], []
    window.on("console", lambda message: window.said.append(message.text))
    window.on("pageerror", lambda error: window.said.append(str(error)))
    window.on("request", lambda request: window.requests.append(request.url))
    window.goto((folder / "comparison.html").as_uri())
    window.wait_for_function("window.specsmooth && specsmooth.state.frames > 0")
    yield window
    # all that is loaded is the page itself: and whatever a test did, nothing complained
    assert [url for url in window.requests if not url.startswith("data:")] == [(folder / "comparison.html").as_uri()]
    assert window.said == []
    window.close()


def pixels(window, index, tmp_path):
    """What a panel shows, (h, w, 3)."""
    window.wait_for_timeout(150)
    path = tmp_path / "cell.png"
    window.locator(f".cell[data-panel='{index}']").screenshot(path=str(path))
    image = pyvista.read(path)
    width, height, _ = image.dimensions
    return np.asarray(image.active_scalars).reshape(height, width, -1)[..., :3].astype(float)[::-1]


def drawn(image):
    """The part below the name."""
    return image[45:-5, 5:-5]


@in_a_browser
def test_every_panel_shows_its_surface(opened, tmp_path):
    roughness = []
    cells = opened.locator(".cell")
    assert cells.count() == 4  # as given, the truth, and those that did not crash
    for i in range(cells.count()):
        image = drawn(pixels(opened, i, tmp_path))
        surface = (image < 250).any(axis=2)
        assert 0.15 < surface.mean() < 0.8
        inside = surface[:, 1:] & surface[:, :-1]
        roughness.append(np.abs(np.diff(image.mean(axis=2), axis=1))[inside].mean())
    assert roughness[0] == max(roughness)  # flat shading shows the noise
    assert roughness[0] > 2 * roughness[1]


@in_a_browser
def test_dragging_one_turns_all(opened, tmp_path):
    before = [drawn(pixels(opened, i, tmp_path)) for i in range(4)]
    box = opened.locator(".cell[data-panel='2']").bounding_box()
    opened.mouse.move(box["x"] + 150, box["y"] + 180)
    opened.mouse.down()
    opened.mouse.move(box["x"] + 230, box["y"] + 120, steps=4)
    opened.mouse.up()
    after = [drawn(pixels(opened, i, tmp_path)) for i in range(4)]
    assert all(np.abs(a - b).mean() > 5 for a, b in zip(before, after, strict=True))
    # all from the same direction: the silhouettes are those of one torus
    shapes = [(image < 250).any(axis=2) for image in after]
    assert all((shape != shapes[1]).mean() < 0.06 for shape in shapes)
    opened.click("#reset")
    back = [drawn(pixels(opened, i, tmp_path)) for i in range(4)]
    assert all(np.array_equal(a, b) for a, b in zip(before, back, strict=True))


@in_a_browser
def test_before_and_after(opened, tmp_path):
    given, smoothed = (drawn(pixels(opened, i, tmp_path)) for i in (0, 2))
    opened.click("#flip")
    assert np.abs(drawn(pixels(opened, 2, tmp_path)) - given).mean() < 2
    assert opened.locator("#mix").input_value() == "0"
    opened.click("#flip")
    assert np.array_equal(drawn(pixels(opened, 2, tmp_path)), smoothed)


@in_a_browser
@pytest.mark.parametrize("key", ["error", "displacement", "curvature"])
def test_colors_have_a_common_scale_and_a_legend(opened, tmp_path, key):
    assert opened.locator("#legend").is_hidden()
    opened.select_option("#color", key)
    image = drawn(pixels(opened, 0, tmp_path))
    surface = (image < 250).any(axis=2)
    saturation = np.ptp(image, axis=2)[surface]
    assert saturation.mean() > 40
    assert opened.locator("#legend").is_visible()
    low, high = (float(opened.locator(x).inner_text()) for x in ("#low", "#high"))
    assert low < high
    assert low == (-high if key == "curvature" else 0)
    if key == "error":  # viridis: the truth is dark, the mesh as given bright
        assert image[surface].mean() > 1.5 * drawn(pixels(opened, 1, tmp_path))[surface].mean()


@in_a_browser
def test_values_under_the_mouse(opened):
    tip, cell = opened.locator("#tip"), opened.locator(".cell[data-panel='2']")
    assert tip.is_hidden()
    cell.scroll_into_view_if_needed()
    box = cell.bounding_box()
    opened.mouse.move(box["x"] + box["width"] / 2, box["y"] + 270)  # the lower part of the ring
    tip.wait_for(state="visible", timeout=5000)
    said = tip.inner_text().splitlines()
    assert re.fullmatch(r"vertex \d+", said[0])
    figures = dict(line.split(": ") for line in said[1:])
    assert list(figures) == ["distance to the truth", "displacement", "curvature"]
    assert 0 < float(figures["displacement"].split()[0]) < 1.5
    opened.mouse.move(box["x"] + box["width"] / 2, box["y"] + 15)
    tip.wait_for(state="hidden", timeout=5000)
    opened.locator(".bar").first.hover()
    assert "time" in tip.inner_text()
    plot = opened.locator(".plot").first
    plot.scroll_into_view_if_needed()
    x, y, text = json.loads(plot.get_attribute("data-marks"))[0]
    box = plot.locator("svg").bounding_box()
    opened.mouse.move(box["x"] + x * box["width"] + 1, box["y"] + y * box["height"])
    assert tip.inner_text() == text
    assert "noise removed" in text


@in_a_browser
def test_a_bar_in_each_view_tells_lengths(opened):
    bar = opened.locator(".cell[data-panel='2'] .scale")

    def pixels_a_unit():
        opened.evaluate("specsmooth.draw()")
        return bar.bounding_box()["width"] / float(bar.inner_text().split(" (")[0])

    before = pixels_a_unit()
    height = opened.locator(".cell").first.bounding_box()["height"] - 40
    assert before * 1.08 * np.ptp(torus(40, 24)[0], axis=0).max() == pytest.approx(height, rel=0.1)  # and some noise
    opened.evaluate("specsmooth.state.height /= 7")
    assert pixels_a_unit() == pytest.approx(7 * before, rel=0.02)


@in_a_browser
def test_windows_of_any_width_show_all(opened):
    for width in (1400, 800, 400):
        opened.set_viewport_size({"width": width, "height": 1000})
        assert opened.evaluate("document.documentElement.scrollWidth") == width
        # what scrolls does so inside of its box, where numbers are seen at once
        for each in opened.evaluate("""[...document.querySelectorAll('.scroll')].map(s => [
                s.scrollWidth - s.clientWidth, s.getBoundingClientRect().right,
                s.querySelector('tbody td').getBoundingClientRect().right])"""):
            assert each[0] == 0 or width < 1400
            assert each[2] <= each[1] <= width
        cut = opened.evaluate("""[...document.querySelectorAll('.who,.figure,.cell b,.track .failed')].filter(
                e => e.offsetParent && e.scrollWidth > e.clientWidth + 1 && getComputedStyle(e).display !== 'inline'
            ).map(e => e.textContent)""")
        assert cut == []


@in_a_browser
def test_tables_sort_and_what_failed_stays_last(opened):
    table = opened.locator("table.sortable").first
    column = table.locator("thead th").all_inner_texts().index("normal error\ndegrees")
    for direction in (1, -1):
        table.locator("thead th").nth(column).click()
        rows = table.locator("tbody tr")
        assert "crashed" in rows.last.inner_text()
        values = [float(rows.nth(i).locator("td").nth(column - 1).inner_text()) for i in range(rows.count() - 1)]
        assert values == sorted(values, reverse=direction < 0)


@in_a_browser
def test_panels_come_and_go(opened):
    opened.locator(".chips input").nth(1).uncheck()
    assert opened.locator(".cell").nth(1).is_hidden()
    opened.locator(".chips input").nth(1).check()
    assert opened.locator(".cell").nth(1).is_visible()


@in_a_browser
def test_in_print_there_are_pictures_in_place_of_views(opened):
    assert opened.locator("#pictures").is_hidden()
    opened.emulate_media(media="print")
    assert opened.locator("#pictures img").count() == 4
    assert opened.locator("#pictures").is_visible()
    assert opened.locator("#views").is_hidden()
    assert all(opened.evaluate("[...document.querySelectorAll('#pictures img')].map(i => i.naturalWidth > 100)"))


@in_a_browser
def test_without_webgl_there_are_pictures(browser, folder):
    window = browser.new_page()
    window.add_init_script("HTMLCanvasElement.prototype.getContext = () => null")
    window.goto((folder / "comparison.html").as_uri())
    assert window.locator("#pictures").is_visible()
    assert window.locator("#nogl").is_visible()
    assert window.locator("#views").is_hidden()
    window.close()


def test_the_page_says_what_is_needed_to_do_it_again(folder):
    text = (folder / "comparison.html").read_text(encoding="utf-8")
    assert "a &lt;torus&gt; &amp; more" in text
    assert "<torus>" not in text
    assert "ms.apply_coord_taubin_smoothing()" in text
    assert "crashed (SIG" in text
    assert mss.__version__ in text
    assert pymeshlab.__version__ in text if hasattr(pymeshlab, "__version__") else "pymeshlab" in text
    assert re.search(r'<code title="[0-9a-f]{64}">', text)
    prose = re.sub(r"<script.*?</script>|<style.*?</style>", "", text, flags=re.DOTALL)
    assert "`" not in prose
    assert "-0.000" not in prose
    # no address but those of SVG's vocabularies
    assert set(re.findall(r"https?://[\w.]+", text)) <= {
        "http://www.w3.org",
        "http://creativecommons.org",
        "http://purl.org",
    }


def test_the_project_has_a_layer_a_result_with_its_error(folder):
    ms = pymeshlab.MeshSet()
    ms.load_project(str(folder / "comparison.mlp"))
    labels = [mesh.label() for mesh in ms]
    assert [label.split(" (")[0] for label in labels[:3]] == ["as given", "the truth", "specsmooth automatic"]
    assert all(re.fullmatch(r"[^.]+ \(blue 0, red \d+ % of an edge from the truth\)", label) for label in labels)
    assert len(labels) == 4
    assert ms.mesh(1).vertex_scalar_array().max() == 0
    assert ms.mesh(0).vertex_scalar_array().max() > 0
    assert ms.mesh(0).has_vertex_color()


def test_decimation_keeps_the_shape():
    V, F = torus(200, 120)
    kept, faces = cluster_vertices(V, F.astype(np.int32), 5000)
    assert 2000 < len(kept) <= 5000
    thin = mss.Surface(V[kept], faces)
    area = [
        np.linalg.norm(np.cross(*(W[f[:, i]] - W[f[:, 0]] for i in (1, 2))), axis=1).sum()
        for W, f in ((V, F), (thin.vertices, thin.faces))
    ]
    assert area[1] == pytest.approx(area[0], rel=0.05)


def test_the_page_of_a_large_mesh_states_that_it_is_decimated(tmp_path):
    found = mss.compare(rough(sheet(40, 30)), filters=["taubin"])
    export.write(found, tmp_path, max_drawn=500)
    text = (tmp_path / "comparison.html").read_text(encoding="utf-8")
    assert "For display only, the 1,200 vertices are reduced to " in text
