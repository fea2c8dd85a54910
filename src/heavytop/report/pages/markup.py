"""Texts, data and pictures as parts of a page: nothing in them is taken for markup or a script."""

from __future__ import annotations

import json
import re
from base64 import b64encode
from hashlib import sha256
from pathlib import Path
from typing import Any, Final
from urllib.parse import quote

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape

TEMPLATES: Final = Path(__file__).parent / "templates"
SCRIPTS: Final = ("player.js", "page.js")
POLICY: Final = (
    "default-src 'none'; img-src data: blob:; style-src 'unsafe-inline'; script-src {}; "
    "base-uri 'none'; form-action 'none'"
)
MOMENTA: Final = {"p_phi": "φ", "p_psi": "ψ", "p_φ": "φ", "p_ψ": "ψ"}
PLAIN: Final = " !$'()*+,-./:;=?@[]^_`{|}~"  # what an address in an attribute may hold as it is
UNSEEN: Final = re.compile(r"<\?xml.*?\?>|<!.*?>|<metadata>.*?</metadata>", re.DOTALL)
DRAWN: Final = re.compile(r"<(?:path|use)\b[^>]*>")
STYLE: Final = re.compile(r'\bstyle="([^"]*)"')
HUNDREDTHS: Final = re.compile(r"(?<![\w.])([1-9]\d*\.\d\d)\d+")


def rendered(template: str, **values: Any) -> str:
    """A template with its style and scripts: one file, which asks no network for anything."""
    jinja = Environment(
        loader=PackageLoader("heavytop.report.pages"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    jinja.filters |= {"typeset": _typeset, "script_data": _script_data, "address": address}
    own = {
        name.replace(".", "_"): Markup((TEMPLATES / name).read_text("utf-8"))
        for name in (*SCRIPTS, "page.css")
    }
    # No script may run on a page but its own, told by their fingerprints, whoever wrote another.
    prints = (sha256((TEMPLATES / name).read_bytes()).digest() for name in SCRIPTS)
    allowed = " ".join(f"'sha256-{b64encode(each).decode('ascii')}'" for each in prints)
    return jinja.get_template(template).render(**own, **values, policy=POLICY.format(allowed))


def _typeset(text: str) -> Markup:
    """A text of ours or of others, with the index of a momentum below the line."""
    return Markup(
        re.sub(rf"\b({'|'.join(MOMENTA)})(?![a-z_])", lambda m: f"p<sub>{MOMENTA[m[1]]}</sub>",
               str(escape(text)))
    )  # fmt: skip


def _script_data(value: Any) -> Markup:
    """JSON for a script element, in which nothing can end that element."""
    text = json.dumps(value, allow_nan=False, separators=(",", ":"))
    for letter in "<>&":
        text = text.replace(letter, f"\\u{ord(letter):04x}")
    return Markup(text)


def address(svg: str) -> Markup:
    """A picture as an address that an image takes: in an image, no script of it can run.

    What is not seen is left out: comments, metadata, decimals beyond a hundredth of a point; and a
    style that many curves and marks have is written once.
    """
    classes: dict[str, str] = {}

    def short(tag: re.Match[str]) -> str:
        found = STYLE.sub(
            lambda style: f'class="{classes.setdefault(style[1], f"c{len(classes)}")}"', tag[0]
        )
        return HUNDREDTHS.sub(r"\1", found).replace('"', "'")

    small = DRAWN.sub(short, UNSEEN.sub("", svg))
    rules = "".join(f".{name}{{{style}}}" for style, name in classes.items())
    small = small.replace("</svg>", f"<style>{rules}</style></svg>")
    return Markup("data:image/svg+xml," + quote(" ".join(small.split()), safe=PLAIN))
