"""How the documentation becomes a site: `make docs`."""

from homeostat import __version__

project = "Homeostat"
copyright = "The Homeostat authors"
version = release = __version__
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
myst_heading_anchors = 3
autodoc_member_order = "bysource"
autodoc_typehints = "description"
exclude_patterns = ["_build"]
html_theme = "alabaster"
html_theme_options = {"description": "From a detected fault to a validated corrective action", "page_width": "1100px"}
html_static_path = []
# Pages link to files of the repository that are no pages of the site.
suppress_warnings = ["myst.xref_missing"]
