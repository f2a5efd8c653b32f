"""Pictures of the page as an operator first sees it: ``python -m benchmarks.console.pictures [--seed N]``."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Final

from benchmarks.console.browser import chromium
from benchmarks.console.runs import KINDS, made, served

SIZES: Final = ((1920, 1080), (1280, 800), (800, 1100))
"""Widths and heights of screens [px]."""
THEMES: Final = ("light", "dark")


def pictures(kind: str, seed: int, folder: Path) -> list[Path]:
    """The page of one run at the moment at which something was first decided, in all sizes and both themes."""
    run_dir, found = made(kind, seed, folder), []
    with served(run_dir) as (address, _), chromium() as browser:
        for width, height in SIZES:
            for theme in THEMES:
                page = browser.new_page(viewport={"width": width, "height": height}, color_scheme=theme)
                page.goto(address)
                page.wait_for_selector("#card")
                page.wait_for_timeout(1500)
                found.append(folder / f"{kind}-{seed}-{width}-{theme}.png")
                page.screenshot(path=found[-1])
                page.close()
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("runs/console"))
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    for kind in KINDS:
        for path in pictures(kind, options.seed, options.out):
            print(path)


if __name__ == "__main__":
    main()
