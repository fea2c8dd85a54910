"""What stands in the HTML of a page beside its sections: scripts, styles and data, all in it."""

from __future__ import annotations

import json
from base64 import b64encode
from hashlib import sha256
from pathlib import Path
from typing import Any


def script_data(value: Any) -> Any:
    """JSON for a script element, in which nothing can end that element."""
    from markupsafe import Markup

    text = json.dumps(value, allow_nan=False, separators=(",", ":"))
    for letter in "<>&":
        text = text.replace(letter, f"\\u{ord(letter):04x}")
    return Markup(text)


def allowed(*scripts: str) -> str:
    """The scripts that may run on the page, by their fingerprints: no other, whoever wrote it."""
    prints = (b64encode(sha256(text.encode("utf-8")).digest()) for text in scripts)
    return " ".join(f"'sha256-{each.decode('ascii')}'" for each in prints)


def template(name: str) -> str:
    """A file of the page: its style, or one of its own scripts."""
    return (Path(__file__).parent / "templates" / name).read_text("utf-8")


def library() -> str:
    """The library that draws what can be turned; whole, so that no network is asked for it."""
    from plotly.offline import get_plotlyjs

    source: str = get_plotlyjs()
    return source.replace("</script", "<\\/script")
