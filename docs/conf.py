"""Settings of the documentation site; ``python3 scripts/make_site.py`` builds it."""

import logging
import os
import sys

import pyvista
from sphinx_gallery.sorting import FileNameSortKey

import meshlab_specsmooth

project = "meshlab_specsmooth"
author = "The meshlab_specsmooth developers"
project_copyright = author
version = release = meshlab_specsmooth.__version__

extensions = [
    "sphinx_design",
    "myst_nb",
    "numpydoc",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx_gallery.gen_gallery",
]
exclude_patterns = [
    "gallery/*",
    "auto_gallery/*.ipynb",
    "sg_execution_times.rst",
    "**/sg_execution_times.rst",
]
root_doc = "index"
# the first one is that of the pages that autosummary makes
source_suffix = {".rst": "restructuredtext", ".md": "myst-nb", ".ipynb": "myst-nb"}
templates_path = ["_templates"]

# pictures are rendered without a window, by EGL where there is no display
pyvista.OFF_SCREEN = True
pyvista.BUILDING_GALLERY = True
if sys.platform == "linux" and "DISPLAY" not in os.environ:
    os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
pyvista.global_theme.background = "white"
pyvista.global_theme.font.color = "black"
pyvista.global_theme.color = "#d8c9a8"
pyvista.global_theme.window_size = [900, 440]
pyvista.global_theme.transparent_background = False

# no page is affected by a blank in the path of the clone
logging.getLogger("sphinx.sphinx-gallery").addFilter(lambda record: "with spaces found" not in record.getMessage())


class OpenPlotters(pyvista.Scraper):
    """PyVista's scraper, without the plotters that the package has opened and closed for files."""

    def __call__(self, *arguments):
        plotters = pyvista.plotting.plotter._ALL_PLOTTERS
        for name in [name for name, plotter in plotters.items() if plotter.last_image is None]:
            del plotters[name]
        return super().__call__(*arguments)


sphinx_gallery_conf = {
    "examples_dirs": ["gallery"],
    "gallery_dirs": ["auto_gallery"],
    "filename_pattern": r"\.py$",
    "within_subsection_order": FileNameSortKey,
    "image_scrapers": ("matplotlib", OpenPlotters()),
    "abort_on_example_error": True,
    "download_all_examples": False,
    "remove_config_comments": True,
    "show_memory": False,
    "show_signature": False,
    "min_reported_time": 1e9,
    "matplotlib_animations": False,
    "reset_argv": lambda *_: [],
}

# the notebook is executed; its bars, which are drawn over each other in a notebook, are left out here
nb_execution_mode = "cache"
nb_execution_raise_on_error = True
nb_execution_timeout = 120
nb_output_stderr = "remove"
myst_enable_extensions = ["colon_fence"]
myst_heading_anchors = 3
suppress_warnings = ["config.cache", "mystnb.unknown_mime_type"]

autosummary_generate = True
autodoc_typehints = "none"
numpydoc_show_class_members = False
numpydoc_class_members_toctree = False

html_theme = "pydata_sphinx_theme"
html_title = f"meshlab_specsmooth {version}"
html_theme_options = {
    "navbar_align": "left",
    "show_toc_level": 2,
    "show_nav_level": 1,
    "navigation_with_keys": False,
    "secondary_sidebar_items": ["page-toc"],
    "footer_start": ["copyright"],
    "footer_end": [],
}
html_static_path = ["_static"]
html_css_files = ["site.css"]
# pages without pages below them have no navigation at the left
html_sidebars = {name: [] for name in ("which", "guide", "notebook", "filters", "coming_from", "index")}
html_show_sourcelink = False
html_copy_source = False
