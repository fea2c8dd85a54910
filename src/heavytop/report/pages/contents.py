"""What is on a page: of each result that was found, its section."""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from heavytop.report.pages.claims import claims_section
from heavytop.report.pages.diagrams import energy_momentum_section
from heavytop.report.pages.failures import stress_section
from heavytop.report.pages.foreign import reading
from heavytop.report.pages.maps import atlas_section
from heavytop.report.pages.runs import run_section
from heavytop.report.pages.studies import drift_section, workprec_section
from heavytop.report.pages.traces import traces_section

if TYPE_CHECKING:
    from heavytop.report.pages.findings import Finding
    from heavytop.report.pages.section import Section

SECTIONS: Final[Mapping[str, tuple[str, Callable[[Finding, str], Section]]]] = {
    "heavytop/run/1": ("run", run_section),
    "heavytop/traces/1": ("traces", traces_section),
    "heavytop/drift/1": ("drift", drift_section),
    "heavytop/workprec/1": ("workprec", workprec_section),
    "heavytop/stress/1": ("stress", stress_section),
    "heavytop/atlas/1": ("atlas", atlas_section),
    "heavytop/energy-momentum/1": ("energy-momentum", energy_momentum_section),
    "heavytop/validate/1": ("claims", claims_section),
}
"""By schema, the name of a section and what makes it."""


def contents(found: Sequence[Finding]) -> tuple[tuple[Finding, Section], ...]:
    """Return every result with its section.

    Raises
    ------
    ForeignFile
        A result is not what was written; the message names its file.
    """
    return tuple(_told_apart(list(_sections(found))))


def _sections(found: Sequence[Finding]) -> Iterator[tuple[Finding, Section]]:
    counts: dict[str, int] = {}
    for finding in found:
        name, section = SECTIONS[finding.schema]
        counts[name] = counts.get(name, 0) + 1
        with reading(finding.path), warnings.catch_warnings():
            for kind in (RuntimeWarning, UserWarning):  # of numbers that no picture can show
                warnings.simplefilter("ignore", kind)
            made = section(finding, f"{name}-{counts[name]}")
        yield finding, made


def _told_apart(results: Sequence[tuple[Finding, Section]]) -> Iterator[tuple[Finding, Section]]:
    """Sections of one heading with the names of their files, in the player too."""
    counts = Counter(section.heading for _, section in results)
    for finding, section in results:
        one = counts[section.heading] == 1
        heading = section.heading if one else f"{section.heading} ({finding.name})"
        top = section.top and {**section.top, "title": heading}
        yield finding, replace(section, heading=heading, top=top)
