"""Conventions planted in random tops, alone and in pairs, and good data: no wrong name is sure."""

from __future__ import annotations

import sys

from claim import claim, finish
from fuzz_conventions import counted, good, others, pairs, singles

SEED, PART = (int(word) for word in (*sys.argv[1:], 0, 1)[:2])  # a PARTth of all cases

for what, found in (
    ("planted alone", singles(SEED, 20 // PART)),
    ("planted in pairs", pairs(SEED, 300 // PART)),
    ("good data", good(SEED, 300 // PART)),
    ("another problem", others(SEED, 330 // PART)),
):
    counts, wrong = counted(found)
    print("\n".join(wrong))
    for (name, quality, said), number in counts.items():
        print(f"{number:4} {said:10} {name}, {quality}")
    claim(f"{what}: {counts.total()} cases, a wrong name stated as sure", len(wrong), 0)
finish()
