"""Symbols on the page: the little TeX that symbols are written in, as HTML."""

import re
import unicodedata

from markupsafe import Markup, escape

_SIGNS = {"cdot": "\N{MIDDLE DOT}", "times": "\N{MULTIPLICATION SIGN}", "infty": "\N{INFINITY}"}
_TOKEN = re.compile(r"\\([A-Za-z]+)|\\[,;: !]|([_^])|([{}])|([A-Za-z])|(.)", re.DOTALL)
_UPRIGHT = ("mathrm", "rm", "text", "mathit", "operatorname")
_TAGS = {"_": "sub", "^": "sup"}


def symbol_html(tex: str) -> Markup:
    r"""A symbol as HTML: k_{LC} -> <i>k</i><sub>LC</sub>; what is not known stays as text."""
    html, _ = _group(list(_TOKEN.finditer(tex)), 0, upright=False, single=False)
    return Markup(html)


def _greek(command: str) -> str:
    """The letter a command names, or its own name where it names none."""
    case = "SMALL" if command.islower() else "CAPITAL"
    name = command.removeprefix("var").lower().replace("lambda", "lamda")
    try:
        return unicodedata.lookup(f"GREEK {case} LETTER {name.upper()}")
    except KeyError:
        return command


def _group(tokens: list, at: int, upright: bool, single: bool) -> tuple[str, int]:
    """HTML of the tokens from `at` to the end of their group, or of a single token."""
    out: list[str] = []
    while at < len(tokens):
        command, script, brace, letter, other = tokens[at].groups()
        at += 1
        if brace == "}":
            break
        if brace == "{":
            inner, at = _group(tokens, at, upright, single=False)
            out.append(inner)
        elif script:
            inner, at = _group(tokens, at, upright=True, single=True)
            out.append(f"<{_TAGS[script]}>{inner}</{_TAGS[script]}>")
        elif command in _UPRIGHT:
            inner, at = _group(tokens, at, upright=True, single=True)
            out.append(inner)
        elif command:
            out.append(str(escape(_SIGNS.get(command) or _greek(command))))
        elif letter:
            out.append(letter if upright else f"<i>{letter}</i>")
        else:
            out.append(str(escape(other or " ")))
        if single:
            break
    return "".join(out), at
