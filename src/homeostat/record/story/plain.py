"""What others say of a formula, in the words of somebody who does not write formulas."""

import re
from typing import Final

_JUDGED: Final = re.compile(
    r"(?<![^:;')])(?P<what>[^:;']+): '[^']*' "
    r"(?P<how>is violated by|was violated and holds by no more than|holds by no more than|holds by"
    r"|cannot be judged now|cannot be judged, a value that it needs is not known)"
    r"(?P<size> [^\s;(]+ [^\s;]+)?(?: at (?P<at>\S+ s))?(?P<members> in \d+ of \d+ members)?(?P<more>; [^()]*)?"
    r" \((?P<name>[^()]+)\)"
)
_HOW: Final = {"is violated by": "violated by"}


def plainly(text: str) -> str:
    """``text`` with what a judgement says of each formula in fewer words; the formula stands elsewhere.

    >>> plainly("Level is low enough: 'L1 <= 11' is violated by 0.5 L at 63 s in 2 of 36 members (LIM-L)")
    'Level is low enough: violated by 0.5 L, worst after 63 s, in 2 of 36 members (LIM-L)'
    >>> plainly("Highest temperature: 'T1 <= 313' is violated by 2.163 K (LIM-T)")
    'Highest temperature: violated by 2.163 K (LIM-T)'
    >>> plainly("Highest temperature: 'T1 <= 313' cannot be judged now (LIM-T)")
    'Highest temperature: cannot be judged now (LIM-T)'
    """
    return _JUDGED.sub(_said, text)


def _said(found: re.Match[str]) -> str:
    how, worst = found["how"], f", worst after {found['at']}" if found["at"] else ""
    among = f",{found['members']}" if found["members"] else ""
    text = f"{found['what']}: {_HOW.get(how, how)}{found['size'] or ''}{worst}{among}"
    return f"{text}{found['more'] or ''} ({found['name']})"
