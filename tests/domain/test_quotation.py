"""Whatever a text says, quoted it is one line of printable characters that cannot end its own quotation."""

from __future__ import annotations

import re
import unicodedata

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from homeostat.domain.quotation import quote, quoted
from tests.safety.injections import CORPUS

TEXTS = st.one_of(
    st.text(max_size=400),
    st.text(alphabet="«»‹›<>|`-=#~ \n\r\t\u0301\u202e\u200bAa", max_size=200),
    st.sampled_from([i.text for i in CORPUS]),
)
FORBIDDEN = {"Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp"}


@given(TEXTS, st.integers(1, 200))
@example("\ufdfa" * 30, 20)
@example("`" * 7, 3)
@example("<" * 9 + "|", 120)
@example("a\u0301\u0301\u0301\u0301\u0301", 120)
@example("\u1100\u1161", 120)
@example("- - -  ---", 120)
def test_what_always_holds(text: str, limit: int) -> None:
    found = quoted(text, limit)
    assert len(found) <= limit
    assert not any(unicodedata.category(c) in FORBIDDEN for c in found)
    assert not set(found) & set("«»‹›《》\n\r\t")
    assert "<<" not in found and ">>" not in found and "<|" not in found and "|>" not in found
    assert not re.search(r"([-=#`~])\1\1", found)
    assert not re.search(r"  |^ | $", found)
    assert quoted(found, limit) == found, "quoting twice changes nothing"


@given(TEXTS)
def test_a_quotation_has_one_beginning_and_one_end(text: str) -> None:
    found = quote(text, 80)
    assert found[0] == "«" and found[-1] == "»" and found.count("«") == found.count("»") == 1


@pytest.mark.parametrize(
    "text",
    [
        "Cooling valve stuck towards closed",
        "Heat to the jacket [W]",
        "T \u2264 313 K",
        "Ventil V2 \u2013 K\u00fchlwasser",
        "\u0394p 3,5 bar (g) \u2013 \u00d8 50 mm",
        "25 %, 50 \u00b0C, \u00b5m",
        "PF-1: a/b \"c\" 'd' & e; f?",
        "A + D -> B",
        "\u51b7\u5374\u5f01",
    ],
)
def test_what_engineers_write_stays(text: str) -> None:
    assert quoted(text) == unicodedata.normalize("NFKC", text)


@given(st.text(alphabet=st.characters(blacklist_categories=("Cs",)), min_size=1, max_size=50), st.integers(5, 30))
def test_what_is_cut_says_so(text: str, limit: int) -> None:
    whole, cut = quoted(text, 10_000), quoted(text, limit)
    assert cut == whole if len(whole) <= limit else cut.endswith("...") or len(cut) < limit


def test_a_flood_of_marks_is_held_back() -> None:
    assert len(quoted("a" + "\u0301" * 400 + "b", 120)) <= 5
