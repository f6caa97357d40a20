"""Equations as MathML, which browsers set without JavaScript and screen readers read aloud.

Parts are strings of markup. A plain text is taken apart: a number is <mn>, a letter with its index
(`M_HC`, `x_SS`) a variable with an upright index, any other sign an operator.
"""

import re

from markupsafe import Markup, escape

_TOKEN = re.compile(r"([0-9]+(?:\.[0-9]+)?)|([^\W\d_])(?:_([A-Za-z0-9,]+))?|(\S)", re.UNICODE)
_FUNCTIONS = ("tanh",)


def symbol(text: str) -> str:
    """A variable with its index: `k_LC`."""
    base, _, index = text.partition("_")
    letter = f"<mi>{escape(base)}</mi>"
    return (
        f"<msub>{letter}<mi mathvariant='normal'>{escape(index)}</mi></msub>" if index else letter
    )


def words(text: str) -> str:
    """The parts of a plain text, one after another."""
    out = []
    for function in re.split(rf"({'|'.join(_FUNCTIONS)})", text):
        if function in _FUNCTIONS:
            out.append(f"<mi>{function}</mi>")
            continue
        for number, letter, index, sign in _TOKEN.findall(function):
            if number:
                out.append(f"<mn>{number}</mn>")
            elif letter:
                out.append(symbol(f"{letter}_{index}" if index else letter))
            else:
                out.append(f"<mo>{escape(sign)}</mo>")
    return "".join(out)


def _part(part: str) -> str:
    """Markup as it is; a plain text taken apart."""
    return part if part.startswith("<") else words(part)


def row(*parts: str) -> str:
    """Parts in one row."""
    return f"<mrow>{''.join(_part(part) for part in parts)}</mrow>"


def frac(above: str, below: str) -> str:
    """A fraction."""
    return f"<mfrac>{row(above)}{row(below)}</mfrac>"


def power(base: str, exponent: str) -> str:
    """A power."""
    return f"<msup>{row(base)}{row(exponent)}</msup>"


def rate(of: str, order: int = 1) -> str:
    """A derivative by time."""
    if order == 1:
        return frac(row("d", of), "d t")
    return frac(row(power("d", str(order)), of), row("d", power("t", str(order))))


def bracket(*parts: str) -> str:
    """Parts in round brackets."""
    return row("(", *parts, ")")


def equation(*parts: str) -> Markup:
    """A displayed equation."""
    return Markup(f"<math display='block'>{row(*parts)}</math>")
