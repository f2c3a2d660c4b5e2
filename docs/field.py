"""Draws a moment of a game between fixed policies: python docs/field.py field.png."""

import sys
from pathlib import Path

from PIL import Image

from mctf.film import film_of_policies
from mctf.render import frame
from mctf.rules import make_rules
from mctf.scripted import ATTACK_HARD, DEFEND_HARD

MOMENT = 298  # blue 0 runs home with the flag, red 1 is behind it, red 0 tagged
WAKE = 15  # steps


def draw(picture: Path) -> None:
    """Plays the game, which knows no chance, and draws the moment."""
    film = film_of_policies([ATTACK_HARD, ATTACK_HARD, ATTACK_HARD, DEFEND_HARD], make_rules())
    image = frame(film, MOMENT, film.rules, width=1000, trail=film.pos[MOMENT - WAKE : MOMENT + 1])
    Image.fromarray(image).save(picture, optimize=True)


if __name__ == "__main__":
    draw(Path(sys.argv[1]))
