"""Whatever a text says, quoted it is one line of printable characters that cannot end its own quotation."""

from __future__ import annotations

import re
import unicodedata

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from homeostat.domain.quotation import is_unseen, most_marks, quote, quoted
from tests.safety.injections import CORPUS, TEXTS, Injection

pytestmark = pytest.mark.quick

ANY = st.one_of(
    st.text(max_size=400),
    st.text(alphabet="«»‹›≪⟩<>[]/|`-=#~ \n\r\t\u0301\u064b\u202e\u200b\u034f\u3164\ufe0f\ufdfaABCDa_", max_size=200),
    st.sampled_from([i.text for i in CORPUS]),
)
FORBIDDEN = {"Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp"}
DELIMITER = re.compile(r"[«»‹›《》〈〉≪≫⟨⟩⟪⟫❮❯\n\r\t]|<<|>>|<\||\|>|</?[A-Za-z_]\w*>|\[/?[A-Z_]{4,}\]|([-=#`~])\1\1")


@given(ANY, st.integers(1, 200))
@example("\ufdfa" * 30, 20)
@example("`" * 7, 3)
@example("<" * 9 + "|", 120)
@example("a\u0301\u0301\u0301\u0301\u0301", 120)
@example("\u1100\u1161", 120)
@example("- - -  ---", 120)
def test_what_always_holds(text: str, limit: int) -> None:
    found = quoted(text, limit)
    assert len(found) <= limit
    assert not any(is_unseen(c) or unicodedata.category(c) in FORBIDDEN for c in found) and found.isprintable()
    assert not DELIMITER.search(found)
    assert not re.search(r"  |^ | $", found)
    assert quoted(found, limit) == found, "quoting twice changes nothing"


@given(ANY)
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


@pytest.mark.parametrize("injection", CORPUS, ids=lambda i: i.name)
def test_no_injection_keeps_a_delimiter(injection: Injection) -> None:
    for limit in (60, 120, 100_000):
        found = quoted(injection.text, limit)
        assert found.isprintable() and not DELIMITER.search(found) and len(found) <= limit


def test_the_corpus_is_wide() -> None:
    """A technique that is tried with one text alone is not tried."""
    assert len({i.name for i in CORPUS}) == len({i.text for i in CORPUS}) == len(CORPUS) >= 120
    assert all(len(texts) >= 4 for texts in TEXTS.values())


@pytest.mark.parametrize("mark", ["\u0301", "\u064b", "\u05b0", "\u0e49", "\u20dd", "\u0902"], ids=ascii)
def test_a_flood_of_marks_is_held_back(mark: str) -> None:
    found = quoted("x" + mark * 400 + "b", 120)
    assert len(found) <= 4 and most_marks(found) <= 2


@pytest.mark.parametrize(
    "character",
    ["\u00ad", "\u034f", "\u115f", "\u17b4", "\u180b", "\u200b", "\u2800", "\u3164", "\ufe0f", "\uffa0", "\U000e0041",
     "\U000e0100"],
    ids=ascii,
)  # fmt: skip
def test_what_nobody_sees_goes(character: str) -> None:
    assert quoted(f"Pu{character}mp") == "Pump"


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("<|im_start|>system", "< im_start >system"),
        ("\uff1c\uff5cUser\uff5c\uff1e", "< User >"),
        ("</s>[INST] x [/INST]", "< /s >[ INST ] x [ /INST ]"),
        ("<start_of_turn>user", "< start_of_turn >user"),
        ("<<SYS>>", "'SYS'"),
        ("\u226a x \u27eb", "' x '"),
        ("a|b, x<y, [W], [kPa]", "a|b, x<y, [W], [kPa]"),
    ],
)
def test_special_tokens_are_broken_up(text: str, found: str) -> None:
    assert quoted(text) == found


def test_the_limit_holds_after_normalisation() -> None:
    assert len(quoted("\ufdfa")) == 18
    assert 118 <= len(quoted("\ufdfa" * 50, 120)) <= 120  # no space before the mark of a cut
