"""Sphinx: every page is executed, every command shown is run, and a warning fails the build."""

import os
import sys
from pathlib import Path

DOCS = Path(__file__).parent
CACHE = DOCS.parent / ".cache"
sys.path.insert(0, str(DOCS / "_ext"))

# Kernels write into the cache, not into $HOME; what they compile is kept beside the tests'.
os.environ.setdefault("IPYTHONDIR", str(CACHE / "ipython"))
os.environ.setdefault("JUPYTER_RUNTIME_DIR", str(CACHE / "jupyter"))
os.environ.setdefault("HEYOKA_CACHE_DIR", str(CACHE / "heyoka"))
os.environ["PYDEVD_DISABLE_FILE_VALIDATION"] = "1"

from freshness import digest  # noqa: E402

import heavytop  # noqa: E402

project = "heavytop"
author = "The heavytop developers"
copyright = author  # noqa: A001 (its name)
version = release = heavytop.__version__

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "executed",
    "commands",
    "formulas",
    "notebooks",
    "public_names",
    "verbs",
]
exclude_patterns = ["_ext", "_static"]
highlight_language = "none"
myst_heading_anchors = 4
myst_enable_extensions = ["dollarmath", "html_image"]
html_math_renderer = "mathml"

# What a page prints is kept as long as neither the page nor the package changes.
nb_execution_mode = "cache"
nb_execution_cache_path = str(CACHE / "docs" / digest())
nb_execution_in_temp = True
nb_execution_timeout = 120
nb_execution_raise_on_error = False  # a warning: the other pages are still run
nb_merge_streams = True
nb_output_stderr = "error"

suppress_warnings = ["ref.python"]  # `period` in a docstring: of which class, its own text says
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_type_aliases = {"ArrayLike": "ArrayLike", "npt.ArrayLike": "ArrayLike"}
smartquotes_action = "D"  # dashes alone: the E' of a text is no E with a quotation mark
napoleon_google_docstring = False
napoleon_use_ivar = True

html_theme = "furo"
html_static_path = ["_static"]
html_title = f"heavytop {release}"
html_copy_source = False
html_show_sourcelink = False
