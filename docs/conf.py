"""How Sphinx builds the documentation: `make docs`. Nothing is fetched from the network."""

from typing import Any

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


def escaped(lines: list[str]) -> list[str]:
    """Keep the bars of absolute values from being read as substitutions, but for code and displayed equations."""
    out, block = [], None
    for line in lines:
        indent = len(line) - len(line.lstrip())
        if block is not None and line.strip() and indent <= block:
            block = None
        code = block is not None or line.lstrip().startswith((">>>", "..."))
        parts = line.split("``")
        out.append(line if code else "``".join(p if i % 2 else p.replace("|", r"\|") for i, p in enumerate(parts)))
        if block is None and line.rstrip().endswith("::"):
            block = indent
    return out


def setup(app: Any) -> None:
    """Read docstrings as they are written."""
    app.connect("autodoc-process-docstring", lambda *given: given[-1].__setitem__(slice(None), escaped(given[-1])))
