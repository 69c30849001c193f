"""How Sphinx builds the documentation: `make docs`. Nothing is fetched from the network."""

from plastica import __version__

project = "plastica"
author = "The plastica developers"
copyright = "The plastica developers"
release = version = __version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
source_suffix = {".md": "markdown"}
exclude_patterns = ["_build"]

myst_heading_anchors = 3

autodoc_member_order = "bysource"
autodoc_typehints = "none"
napoleon_google_docstring = False
napoleon_use_rtype = False

html_theme = "furo"
html_title = f"plastica {release}"
html_show_sphinx = False
html_copy_source = False
html_show_sourcelink = False
