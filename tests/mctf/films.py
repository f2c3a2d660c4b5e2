"""Films of games between fixed policies."""

from mctf.film import film_of_policies
from mctf.rules import make_rules
from mctf.scripted import NAMES


def film_of(*names, seed=0, **rules):
    return film_of_policies([NAMES.index(name) for name in names], make_rules(**rules), seed)


DUEL = ("attack_hard", "attack_hard", "attack_hard", "defend_hard")
"""Blue and red; both grab, tag and lose the flag, and blue captures it."""
