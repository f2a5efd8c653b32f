"""The page as colour-blind people see it, as one picture: ``python -m benchmarks.console.colours``."""

from __future__ import annotations

import argparse
import io
import subprocess
import sys
from pathlib import Path
from typing import Any, Final

from PIL import Image, ImageDraw, ImageFont

from benchmarks.console.browser import chromium
from benchmarks.console.pictures import THEMES
from benchmarks.console.runs import served
from benchmarks.host import kept

PICTURE: Final = Path(__file__).parents[2] / "docs" / "images" / "console-colours.jpg"
RUN: Final = (
    "cstr", "--fault", "cool_stuck_closed", "--onset", "900", "--end", "1100", "--mode", "advise",
    "--thinking-declared", "1",
)  # fmt: skip
"""Nobody acts, so that a hard limit is violated, and everything abnormal is in the picture."""
AT_S: Final = 1080
DEFICIENCIES: Final = ("protanopia", "deuteranopia", "tritanopia", "achromatopsia")
SIZE: Final = (1280, 1100)
"""What is seen of the page [px]."""
SHOWN: Final = (880, 756)
"""How large it is in the picture [px]."""
TITLE: Final = 30
MOST_BYTES: Final = 200_000


def seen(browser: Any, address: str, deficiency: str, theme: str) -> Image.Image:
    """The page as somebody with ``deficiency`` sees it."""
    page = browser.new_page(viewport={"width": SIZE[0], "height": SIZE[1]}, color_scheme=theme)
    line = page.context.new_cdp_session(page)
    line.send("Emulation.setEmulatedVisionDeficiency", {"type": deficiency})
    page.goto(f"{address}#t={AT_S}")
    page.wait_for_selector(".trend canvas")
    page.wait_for_timeout(1500)
    image = Image.open(io.BytesIO(page.screenshot())).convert("RGB")
    page.close()
    return image


def together(images: dict[tuple[str, str], Image.Image]) -> Image.Image:
    """All of them, a row for each deficiency, a column for each theme."""
    wide, high = SHOWN[0], SHOWN[1] + TITLE
    sheet = Image.new("RGB", (wide * len(THEMES), high * len(DEFICIENCIES)), "white")
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(18)
    for row, deficiency in enumerate(DEFICIENCIES):
        for column, theme in enumerate(THEMES):
            draw.text((column * wide + 8, row * high + 4), f"{deficiency}, {theme}", "black", font)
            small = images[deficiency, theme].resize(SHOWN, Image.Resampling.LANCZOS)
            sheet.paste(small, (column * wide, row * high + TITLE))
    return sheet


def packed(image: Image.Image) -> bytes:
    """The picture as JPEG of :data:`MOST_BYTES` at most, as good as that allows."""
    for scale in (1.0, 0.9, 0.8, 0.7, 0.6):
        size = round(image.width * scale), round(image.height * scale)
        for quality in (70, 55, 45, 35):
            out = io.BytesIO()
            image.resize(size, Image.Resampling.LANCZOS).save(out, "JPEG", quality=quality, optimize=True)
            if out.tell() <= MOST_BYTES:
                return out.getvalue()
    raise RuntimeError(f"the picture does not fit into {MOST_BYTES} byte")


def main() -> None:
    """Make the run where it is not there, look at it, and write the picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--whole", type=Path, help="folder for each of the pictures in full size, too")
    options = parser.parse_args()
    folder = kept("console")
    folder.mkdir(parents=True, exist_ok=True)
    run = folder / "advised"
    if not run.is_dir():
        command = [sys.executable, "-m", "homeostat", "run", *RUN, "--out", str(run)]
        subprocess.run(command, check=False, stdout=subprocess.DEVNULL)  # that a limit is violated is no failure
    images = {}
    with served(run) as (address, _), chromium() as browser:
        for deficiency in DEFICIENCIES:
            for theme in THEMES:
                images[deficiency, theme] = seen(browser, address, deficiency, theme)
    if options.whole is not None:
        options.whole.mkdir(parents=True, exist_ok=True)
        for (deficiency, theme), image in images.items():
            image.save(options.whole / f"{deficiency}-{theme}.png")
    PICTURE.write_bytes(packed(together(images)))


if __name__ == "__main__":
    main()
