"""Conventions planted in random tops, alone and in pairs, and good data: no wrong name is sure."""

from __future__ import annotations

import sys

from claim import claim, finish
from fuzz_conventions import counted, good, others, pairs, singles

SEED, PART = (int(word) for word in (*sys.argv[1:], 0, 1)[:2])  # a PARTth of all cases

# Another start, such as one whose φ̇ has the other sign, may be the same as several conventions.
for what, found, part in (
    ("planted alone", singles(SEED, 20 // PART), 0),
    ("planted in pairs", pairs(SEED, 300 // PART), 0),
    ("good data", good(SEED, 300 // PART), 0),
    ("another problem", others(SEED, 330 // PART), 0.02),
):
    counts, wrong = counted(found)
    print("\n".join(wrong))
    for (name, quality, said), number in counts.items():
        print(f"{number:4} {said:10} {name}, {quality}")
    cases = counts.total()
    claim(f"{what}: {cases} cases, a wrong name stated as sure", len(wrong), part * cases)
finish()
