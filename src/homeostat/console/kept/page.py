"""The page of a run as one file, which opens from a disk."""

from __future__ import annotations

import base64
import gzip
import hashlib
import html
from importlib.resources import files
from typing import Any

from homeostat.console.text import to_json


def kept_page(record: dict[str, Any], title: str) -> str:
    """The file: script, style and ``record`` in it; its policy admits these and nothing from anywhere else."""
    static = files("homeostat.console.server").joinpath("static")
    script, style = (static.joinpath(name).read_text(encoding="utf-8") for name in ("console.js", "console.css"))
    if "</script" in script or "</style" in style:
        raise AssertionError("the built page would end its own element")
    data = base64.b64encode(gzip.compress(to_json(record).encode(), mtime=0)).decode()
    policy = (
        f"default-src 'none'; script-src {_hash(script)}; style-src {_hash(style)}; img-src data:; base-uri 'none'; "
        "form-action 'none'; require-trusted-types-for 'script'"
    )
    return f"""<!doctype html>
<html lang="en">
  <head>
    <meta charset="utf-8">
    <meta http-equiv="Content-Security-Policy" content="{policy}">
    <meta name="viewport" content="width=device-width, initial-scale=1">
    <meta name="color-scheme" content="light dark">
    <meta name="referrer" content="no-referrer">
    <title>{html.escape(title)}</title>
    <link rel="icon" href="data:,">
    <style>{style}</style>
  </head>
  <body><noscript>The page needs JavaScript.</noscript>
    <script type="application/gzip" id="kept">{data}</script>
    <script type="module">{script}</script>
  </body>
</html>
"""


def _hash(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"
