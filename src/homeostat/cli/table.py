"""Rows of text as aligned columns."""

import sys
from collections.abc import Sequence
from typing import Final

from rich.box import Box
from rich.console import Console
from rich.padding import Padding
from rich.table import Column, Table
from rich.text import Text

from homeostat.domain.quotation import printable

_RULED: Final = Box("    \n    \n -  \n    \n    \n    \n    \n    \n", ascii=True)
"""Nothing but a rule under the heads."""
_WIDEST: Final = 10_000
"""Characters of a line that is not shown on a terminal: nobody folds it."""


def show_table(heads: Sequence[str], rows: Sequence[Sequence[str]], indent: int = 0) -> None:
    """Print the heads, a rule and the rows; what does not print is written as an escape."""
    shown = Table(
        *(Column(_cell(head)) for head in heads), box=_RULED, show_edge=False, padding=(0, 1, 0, 0), header_style=""
    )
    for row in rows:
        shown.add_row(*map(_cell, row))
    console = Console(width=None if sys.stdout.isatty() else _WIDEST)
    with console.capture() as lines:
        console.print(Padding(shown, (0, 0, 0, indent), expand=False))
    print(*(line.rstrip() for line in lines.get().splitlines()), sep="\n")


def _cell(text: str) -> Text:
    return Text(printable(text))
