"""Pictures of a game: an RGB array, a text for the terminal, a GIF, a window. Nothing here changes a game.

What is drawn is row ``b`` of a ``State`` (a game) or of a ``Film`` (a frame): the fields have the same names.
"""

import functools
import math
import os
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from mctf.film import TEAM_NAMES, Film, home, is_right, number_of, said, team_of
from mctf.rules import BLUE, RED, Rules
from mctf.sheet import Color, Sheet
from mctf.state import CAPTURES, GRABS, TAGS, State

FRAMES_PER_SECOND = 10
"""Of windows and of the environment's pictures."""
COLORS: tuple[Color, Color] = ((0, 98, 163), (204, 82, 0))
"""Of blue and of red; apart for every kind of colour-blindness (after Okabe and Ito)."""
TINTS: tuple[Color, Color] = ((222, 234, 244), (249, 235, 225))
INK, PALE, SHORE, TAGGED = (38, 50, 60), (118, 130, 140), (120, 140, 155), (138, 146, 153)
WHITE = (255, 255, 255)
_SIDE = ((0.82, 0.14), (0.6, 0.3), (0.35, 0.41), (0.05, 0.46), (-0.6, 0.44), (-0.82, 0.36), (-0.9, 0.2))
HULL = ((1.0, 0.0), *_SIDE, *((ahead, -side) for ahead, side in reversed(_SIDE)))
"""Outline of a vehicle, ahead and to the side, in half lengths."""
GIF_FRAMES = 150
WAKE_S = 15.0


Rows: TypeAlias = State | Film
"""What is drawn: games or frames."""


def clock(seconds: float) -> str:
    """Returns a time as minutes and whole seconds, such as 2:05."""
    whole = int(seconds + 1e-6)
    return f"{whole // 60}:{whole % 60:02d}"


def frame(
    rows: Rows, b: int, rules: Rules, width: int = 800, caption: str | None = None, trail: NDArray[Any] | None = None
) -> NDArray[np.uint8]:
    """Returns a picture of one moment, (H, width, 3) RGB.

    Seen are walls, halves, keep-out circles, flags, who can tag and how far, who must wait how long (an arc that
    closes), who is tagged (grey, crossed out), score and clock.

    Args:
        rows: games or frames; unchanged.
        b: which of them.
        rules: the game's constants.
        width: pixels, at least 200.
        caption: a line below the field; None for no room for one.
        trail: (K, V, 2) m, where the vehicles were, oldest first; None draws no wakes.
    """
    if width < 200:
        raise ValueError(f"width must be >= 200 pixels, but is {width}.")
    sheet = _water(rules, width, caption is not None).copy()
    _heading_line(sheet, rows, b, rules)
    if caption:
        middle = (sheet.size[0] / 2, (sheet.bottom + sheet.size[1]) / 2)
        sheet.write(middle, caption, 0.42 * sheet.line, INK, "mm")
    vehicles = range(rows.pos.shape[1])
    for v in vehicles:
        _reach(sheet, rows, b, v, rules)
    for v in vehicles:
        _wake(sheet, [] if trail is None else [sheet.at(x, y) for x, y in trail[:, v]], COLORS[team_of(v, rules)])
    for team in (BLUE, RED):
        if not any(rows.has_flag[b, v] and team_of(v, rules) != team for v in vehicles):
            _flag(sheet, sheet.at(*home(team, rules)), COLORS[team], 1.3 * sheet.hull)
    for v in vehicles:
        _vehicle(sheet, rows, b, v, rules)
    return sheet.array()


@functools.lru_cache(maxsize=8)
def _water(rules: Rules, width: int, captioned: bool) -> Sheet:
    """Returns what is the same in all pictures of a game."""
    sheet = Sheet(rules, width, captioned)
    middle = rules.width_m / 2.0
    for team in (BLUE, RED):
        left = middle if is_right(team, rules) else 0.0
        sheet.rectangle(sheet.at(left, rules.height_m), sheet.at(left + middle, 0.0), TINTS[team])
    cell = rules.width_m / 10.0
    for k in range(1, 10):
        sheet.lines([sheet.at(k * cell, 0.0), sheet.at(k * cell, rules.height_m)], (*WHITE, 120), 0.001 * width)
    for k in range(1, math.ceil(rules.height_m / cell)):
        sheet.lines([sheet.at(0.0, k * cell), sheet.at(rules.width_m, k * cell)], (*WHITE, 120), 0.001 * width)
    sheet.lines([sheet.at(middle, 0.0), sheet.at(middle, rules.height_m)], (*SHORE, 170), 0.0018 * width)
    for team in (BLUE, RED):
        place = sheet.at(*home(team, rules))
        sheet.disc(place, sheet.scale * rules.flag_keepout_m, (*WHITE, 150), (*COLORS[team], 130), 0.0012 * width)
        sheet.disc(place, 0.14 * sheet.hull, COLORS[team], COLORS[team], 1)
    corners = [(0.0, 0.0), (rules.width_m, 0.0), (rules.width_m, rules.height_m), (0.0, rules.height_m)]
    sheet.lines([sheet.at(*corner) for corner in (*corners, *corners[:2])], SHORE, 0.003 * width)
    return sheet


def _heading_line(sheet: Sheet, rows: Rows, b: int, rules: Rules) -> None:
    """Writes each team's score on its side, and the clock between."""
    y, size = sheet.line / 2, 0.5 * sheet.line
    for team in (BLUE, RED):
        captures, tags, grabs = (int(rows.score[b, team, column]) for column in (CAPTURES, TAGS, GRABS))
        right = is_right(team, rules)
        words = [(f"{TEAM_NAMES[team].capitalize()} {captures}", 1.0, COLORS[team])]
        words.append((f"grabs {grabs} · tags {tags}", 0.64, PALE))
        x = sheet.size[0] - sheet.margin if right else sheet.margin
        for text_, share, color in words:
            wide = sheet.write((x, y), text_, share * size, color, "rm" if right else "lm")
            x += (-1 if right else 1) * (wide + 0.5 * size)
    sheet.write((sheet.size[0] / 2, y), clock(rows.time[b]), size, INK, "mm")


def _reach(sheet: Sheet, rows: Rows, b: int, v: int, rules: Rules) -> None:
    """Draws how far a vehicle tags, if it can, or how much of its waiting time is over."""
    place, color = sheet.at(*rows.pos[b, v]), COLORS[team_of(v, rules)]
    waited = rows.cooldown[b, v] / rules.tagging_cooldown_s
    if waited < 1.0:
        sheet.arc(place, 1.35 * sheet.hull, waited, (*color, 150), 0.12 * sheet.hull)
    elif rows.on_own_side[b, v] and not rows.is_tagged[b, v]:
        sheet.disc(place, sheet.scale * rules.catch_radius_m, (*color, 26), (*color, 90), 0.08 * sheet.hull)


def _wake(sheet: Sheet, points: Sequence[tuple[float, float]], color: Color) -> None:
    for number, ends in enumerate(pairwise(points), start=1):
        sheet.lines(ends, (*color, 150 * number // len(points)), 0.16 * sheet.hull)


def _flag(sheet: Sheet, foot: tuple[float, float], color: Color, tall: float) -> None:
    (x, y), width = foot, 0.09 * tall
    sheet.lines([(x, y), (x, y - tall)], INK, width)
    sheet.polygon([(x, y - tall), (x + 0.75 * tall, y - 0.72 * tall), (x, y - 0.44 * tall)], color, WHITE, 0.5 * width)
    sheet.lines([(x, y), (x, y - tall)], INK, width)


def _vehicle(sheet: Sheet, rows: Rows, b: int, v: int, rules: Rules) -> None:
    """Draws a hull in its direction, its number, a cross if it is tagged, the flag that it carries."""
    team = team_of(v, rules)
    x, y = sheet.at(*rows.pos[b, v])
    course, half = math.radians(rows.heading[b, v]), sheet.hull
    ahead, side = (math.sin(course), -math.cos(course)), (math.cos(course), math.sin(course))
    hull = [(x + half * (p * ahead[0] + q * side[0]), y + half * (p * ahead[1] + q * side[1])) for p, q in HULL]
    tagged = bool(rows.is_tagged[b, v])
    sheet.polygon(hull, TAGGED if tagged else COLORS[team], COLORS[team] if tagged else WHITE, 0.11 * half)
    number = str(number_of(v, rules))
    middle = x - 0.12 * half * ahead[0], y - 0.12 * half * ahead[1]
    if tagged:
        arm = 0.34 * half
        for slope in (-1, 1):
            ends = [(middle[0] - arm, middle[1] - slope * arm), (middle[0] + arm, middle[1] + slope * arm)]
            sheet.lines(ends, WHITE, 0.2 * half)
        sheet.write((x + 0.85 * half, y - 0.85 * half), number, 0.8 * half, COLORS[team], "mm")
    else:
        sheet.write(middle, number, (0.95 if len(number) == 1 else 0.75) * half, WHITE, "mm")
    if rows.has_flag[b, v]:
        sheet.disc((x, y), 1.25 * half, None, COLORS[1 - team], 0.16 * half)
        _flag(sheet, (x + 0.8 * half, y - 0.8 * half), COLORS[1 - team], 1.2 * half)


def text(rows: Rows, b: int, rules: Rules) -> str:
    """Returns a view of the field in ASCII, some 76 characters wide, with score, clock and a line of what is what."""
    columns = 76
    lines = max(8, round(columns / 2 * rules.height_m / rules.width_m))
    grid = [[" "] * columns for _ in range(lines)]

    def put(words: str, x: float, y: float) -> None:
        line = min(max(int((1.0 - y / rules.height_m) * lines), 0), lines - 1)
        start = min(max(round(x / rules.width_m * columns) - len(words) // 2, 0), columns - len(words))
        grid[line][start : start + len(words)] = words

    for line in grid:
        line[columns // 2] = ":"
    vehicles = range(rows.pos.shape[1])
    for team in (BLUE, RED):
        if not any(rows.has_flag[b, v] and team_of(v, rules) != team for v in vehicles):
            put(f"[{TEAM_NAMES[team][0].upper()}]", *home(team, rules))
    for v in vehicles:
        team = team_of(v, rules)
        pointing = "^>v<"[round(rows.heading[b, v] / 90.0) % 4]
        mark = "x" if rows.is_tagged[b, v] else "*" if rows.has_flag[b, v] else pointing
        put(f"{TEAM_NAMES[team][0]}{number_of(v, rules)}{mark}", *rows.pos[b, v])
    scores = ", ".join(
        f"{name} {rows.score[b, team, CAPTURES]} (grabs {rows.score[b, team, GRABS]}, tags {rows.score[b, team, TAGS]})"
        for team, name in enumerate(TEAM_NAMES)
    )
    wall = f"+{'-' * columns}+"
    return "\n".join(
        [
            f"{clock(rows.time[b])} of {clock(rules.max_time_s)}   {scores}",
            *(wall, *(f"|{''.join(line)}|" for line in grid), wall),
            "b0^ vehicle and its heading   b0* carries the flag   b0x is tagged   [B] flag at home",
        ]
    )


def write_gif(film: Film, path: Path, width: int = 600) -> None:
    """Writes a film as a GIF: at most some GIF_FRAMES pictures, with wakes and events, that rests at its end."""
    last = len(film.pos) - 1
    every = max(1, math.ceil(last / GIF_FRAMES))
    wake = round(WAKE_S / (film.rules.substeps * film.rules.tau_s))
    pictures = [
        Image.fromarray(frame(film, t, film.rules, width, _caption(film, t), film.pos[max(0, t - wake) : t + 1]))
        for t in (*range(0, last, every), last)
    ]
    sample = Image.new("RGB", (width, 4 * pictures[0].height))
    for k in range(4):
        sample.paste(pictures[k * (len(pictures) - 1) // 3], (0, k * pictures[0].height))
    palette = sample.quantize(96)
    small = [picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures]
    durations = [80] * (len(small) - 1) + [4000]
    small[0].save(path, "GIF", save_all=True, append_images=small[1:], duration=durations, loop=0, optimize=False)


def _caption(film: Film, t: int) -> str:
    """Returns what happened last, for eight seconds."""
    past = [event for event in film.events if event.frame <= t and film.time[t] - film.time[event.frame] <= 8.0]
    return said(past[-1], film.rules) if past else ""


class Window:
    """A window in which a game is seen while it is played; needs pygame."""

    def __init__(self, rules: Rules, width: int = 800) -> None:
        """Opens nothing yet; the first ``show`` does.

        Raises:
            ImportError: pygame is not there.
        """
        os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
        try:
            import pygame  # noqa: PLC0415 (an optional package)
        except ImportError as error:
            raise ImportError(
                "render_mode='human' needs pygame, which is not there: pip install 'berteam-cli[human]'."
            ) from error
        self._pygame, self._rules, self._width = pygame, rules, width
        self._screen: pygame.Surface | None = None
        self._closed = False
        self._pace = pygame.time.Clock()

    def show(self, rows: Rows, b: int) -> None:
        """Shows one moment, FRAMES_PER_SECOND at most; a window that its user has closed stays closed."""
        if self._closed:
            return
        picture = frame(rows, b, self._rules, self._width)
        size = picture.shape[1], picture.shape[0]
        if self._screen is None:
            self._pygame.display.init()
            self._pygame.display.set_caption("Marine Capture-the-Flag")
            self._screen = self._pygame.display.set_mode(size)
        self._screen.blit(self._pygame.image.frombuffer(picture.tobytes(), size, "RGB"), (0, 0))
        self._pygame.display.flip()
        if any(event.type == self._pygame.QUIT for event in self._pygame.event.get()):
            self.close()
        self._pace.tick(FRAMES_PER_SECOND)

    def close(self) -> None:
        """Closes the window."""
        if self._screen is not None:
            self._pygame.display.quit()
        self._screen, self._closed = None, True
