"""Wrong command lines, made by a generator from a seed, and the check that each is refused cleanly."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator

from tests.wrong import text, together, values
from tests.wrong.known import FIRST, Known, Wrong, known

SEED = 20250

Maker = Callable[[list[Known], random.Random], Iterator[Wrong]]
MAKERS: tuple[Maker, ...] = (
    *(values.wrong_commands, values.wrong_choices, values.wrong_keys, values.wrong_types, values.out_of_bounds),
    *(values.wrong_words, together.contradictions, text.odd_text, text.broken_grammar),
    *(together.paths, together.flags, together.overrides),
)


def cases(seed: int = SEED) -> list[Wrong]:
    """Returns the wrong command lines of ``seed``, no two of them the same."""
    rng = random.Random(seed)
    every = [known(command) for command in FIRST]
    return list({case.words: case for maker in MAKERS for case in maker(every, rng)}.values())
