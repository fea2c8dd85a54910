"""``heavytop derive``."""

from __future__ import annotations

import typer

from heavytop.cli.options import Debug, Json, Latex
from heavytop.cli.output import print_json


def derive(latex: Latex = False, json: Json = False, debug: Debug = False) -> None:
    """Derive from the rotation matrix what is integrated."""
    from heavytop.equations.derivation import as_latex, as_text, derivation, derive_document

    if latex and json:
        raise typer.BadParameter("--json holds the LaTeX too", param_hint="--latex")
    if json:
        print_json(derive_document(derivation()))
    else:
        typer.echo((as_latex if latex else as_text)(derivation()))
