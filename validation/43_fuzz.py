"""Random scenes where numbers break: no call is wrong beyond what it says of itself."""

from __future__ import annotations

import sys

import fuzz_damage
import fuzz_events
import fuzz_many
import fuzz_turns
from claim import claim, finish

SEED, COUNT = int(sys.argv[1]) if len(sys.argv) > 1 else 0, 504

for what, misses, count in (
    ("runs by name, in more digits and continued", fuzz_events.misses, COUNT),
    ("turns near the poles", fuzz_turns.misses, COUNT),
    ("many tops at once", fuzz_many.misses, 8 * COUNT),
    ("damaged files", fuzz_damage.misses, COUNT),
):
    wrong = misses(SEED, count)
    print("\n".join(wrong))
    claim(f"{what}: {count} random cases, silently wrong", len(wrong), 0)
finish()
