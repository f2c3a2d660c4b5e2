"""Pictures show the game as it is, and leave it as it is."""

import os
import subprocess
import sys

import numpy as np
import pytest
from PIL import Image

from mctf.film import filmed, home
from mctf.render import COLORS, GIF_FRAMES, TAGGED, TINTS, Window, clock, frame, text, write_gif
from mctf.rules import BLUE, RED, make_rules
from mctf.sheet import Sheet
from mctf.start import reset
from mctf.state import empty
from tests.mctf.films import DUEL, film_of

WIDTH = 800


def start(**rules):
    rules = make_rules(**rules)
    state = empty(1, rules)
    reset(state, 0, rules)
    return state, rules


def color_at(picture, rules, x, y, right=0.0):
    """Returns the color at a point in m, or so many half hulls right of it."""
    sheet = Sheet(rules, picture.shape[1], captioned=False)
    column, row = sheet.at(x, y)
    return tuple(int(value) for value in picture[round(row), round(column + right * sheet.hull)])


def near(one, other, within=12):
    return max(abs(a - b) for a, b in zip(one, other, strict=True)) <= within


@pytest.mark.parametrize("width", [200, 400, 800, 1601])
def test_size_and_nothing_changed(width):
    state, rules = start(team_size=[3, 2])
    before = [array.tobytes() for array in state]
    picture = frame(state, 0, rules, width)
    assert picture.shape[1:] == (width, 3)
    assert picture.shape[0] < 0.6 * width
    assert picture.dtype == np.uint8
    assert frame(state, 0, rules, width, caption="").shape[0] > picture.shape[0]
    text(state, 0, rules)
    assert [array.tobytes() for array in state] == before
    np.testing.assert_array_equal(picture, frame(state, 0, rules, width))


def test_too_small():
    state, rules = start()
    with pytest.raises(ValueError, match="width must be >= 200 pixels, but is 199"):
        frame(state, 0, rules, 199)


@pytest.mark.parametrize("side", ["right", "left"])
def test_everything_is_where_it_should_be(side):
    state, rules = start(blue_side=side)
    state.pos[0] = [(150.0, 80.0), (150.0, 20.0), (50.0, 80.0), (50.0, 20.0)]
    state.heading[0] = 90.0  # the number stands behind the middle: look ahead of it
    picture = frame(state, 0, rules, WIDTH)
    for v, team in enumerate((BLUE, BLUE, RED, RED)):
        assert color_at(picture, rules, *state.pos[0, v], right=0.6) == COLORS[team]
    right, left = (BLUE, RED) if side == "right" else (RED, BLUE)
    assert color_at(picture, rules, 185.0, 5.0) == TINTS[right]
    assert color_at(picture, rules, 15.0, 95.0) == TINTS[left]


def test_a_vehicle_points_where_it_goes():
    state, rules = start(team_size=1)
    state.is_tagged[0] = True  # no circle around it
    place = state.pos[0, 0] = 150.0, 50.0
    ahead = {0.0: (0, 3.4), 90.0: (3.4, 0), 180.0: (0, -3.4), -90.0: (-3.4, 0)}
    for heading, (x, y) in ahead.items():
        state.heading[0, 0] = heading
        picture = frame(state, 0, rules, WIDTH)
        for other, (dx, dy) in ahead.items():
            reached = color_at(picture, rules, place[0] + dx, place[1] + dy) != TINTS[BLUE]
            assert reached == (other in {heading, heading + 180, heading - 180}), (heading, other)
        # the bow is narrow, the stern wide
        aside = np.array([y, -x]) * 0.55
        bow = color_at(picture, rules, *(np.array(place) + 0.85 * np.array([x, y]) + aside))
        stern = color_at(picture, rules, *(np.array(place) - 0.5 * np.array([x, y]) + 0.75 * aside))
        assert near(bow, TINTS[BLUE])
        assert not near(stern, TINTS[BLUE])


def test_who_can_tag_and_who_is_tagged():
    state, rules = start()
    state.pos[0] = [(150.0, 80.0), (150.0, 20.0), (50.0, 80.0), (50.0, 20.0)]
    state.heading[0] = 90.0
    beside = [(x, y + 0.8 * rules.catch_radius_m) for x, y in state.pos[0]]
    picture = frame(state, 0, rules, WIDTH)
    assert all(color_at(picture, rules, *point) not in TINTS for point in beside)
    state.cooldown[0, 0] = 3.0
    state.is_tagged[0, 1] = True
    state.on_own_side[0, 2] = False
    picture = frame(state, 0, rules, WIDTH)
    shown = [color_at(picture, rules, *point) not in TINTS for point in beside]
    assert shown == [False, False, False, True]
    assert color_at(picture, rules, *state.pos[0, 1], right=0.6) == TAGGED


def test_a_flag_is_at_home_or_with_its_carrier():
    state, rules = start()
    x, y = home(RED, rules)
    there = frame(state, 0, rules, WIDTH)
    state.has_flag[0, 1] = True
    gone = frame(state, 0, rules, WIDTH)
    sheet = Sheet(rules, WIDTH, captioned=False)

    def reds(picture, x, y):
        column, row = (round(value) for value in sheet.at(x, y))
        part = picture[row - 40 : row - 3, column - 5 : column + 40].astype(int)
        return int((np.abs(part - COLORS[RED]).max(axis=2) < 12).sum())

    assert reds(there, x, y) > 40
    assert reds(gone, x, y) == 0
    assert reds(there, *state.pos[0, 1]) == 0
    assert reds(gone, *state.pos[0, 1]) > 40


def test_a_frame_of_a_film_is_the_frame_of_its_state():
    film = film_of(*DUEL)
    state = empty(1, film.rules)
    reset(state, 0, film.rules)
    np.testing.assert_array_equal(frame(film, 0, film.rules), frame(state, 0, film.rules))
    assert text(film, 0, film.rules) == text(state, 0, film.rules)


def test_text():
    state, rules = start(team_size=[2, 1])
    state.pos[0] = [(199.0, 99.0), (100.0, 50.0), (1.0, 1.0)]
    state.heading[0] = [0.0, 170.0, -90.0]
    state.score[0, RED] = 1, 2, 3
    state.time[0] = 65.0
    lines = text(state, 0, rules).splitlines()
    assert lines[0] == "1:05 of 7:00   blue 0 (grabs 0, tags 0), red 1 (grabs 3, tags 2)"
    assert lines[1] == lines[21] == f"+{'-' * 76}+"
    assert {len(line) for line in lines[1:22]} == {78}
    assert lines[2].endswith("b0^|")
    assert lines[20].startswith("|r0<")
    assert "b1v" in lines[11] or "b1v" in lines[12]
    assert "".join(lines[1:22]).count("[B]") == "".join(lines[1:22]).count("[R]") == 1
    state.has_flag[0, 0] = state.is_tagged[0, 2] = True
    state.pos[0, 1] = 300.0, -20.0  # who leaves the field stands at its edge
    lines = text(state, 0, rules).splitlines()
    assert lines[2].endswith("b0*|")
    assert lines[20].startswith("|r0x")
    assert lines[20].endswith("b1v|")
    assert "[R]" not in "".join(lines[1:22])


def test_clock():
    assert [clock(seconds) for seconds in (0.0, 59.9, 60.0, 119.99999999, 3600.0)] == [
        "0:00",
        "0:59",
        "1:00",
        "2:00",
        "60:00",
    ]


def test_gif(tmp_path):
    film = film_of("random", "random", "attack_hard", "defend_hard", max_score=9)
    assert len(film.time) == 421
    write_gif(film, tmp_path / "game.gif")
    assert (tmp_path / "game.gif").stat().st_size < 3_000_000
    with Image.open(tmp_path / "game.gif") as gif:
        assert gif.is_animated
        assert GIF_FRAMES / 2 < gif.n_frames <= GIF_FRAMES + 1
        assert gif.info["loop"] == 0
        first = np.array(gif.convert("RGB"), dtype=int)
        gif.seek(gif.n_frames - 1)
        assert gif.info["duration"] >= 4000
        last = np.array(gif.convert("RGB"), dtype=int)
    wanted = frame(film, 0, film.rules, 600, "").astype(int)
    assert first.shape == last.shape == wanted.shape
    assert np.abs(first - wanted).mean() < 2  # a palette has few colors
    wanted = frame(film, 420, film.rules, 600, "").astype(int)
    assert np.abs(last - wanted).mean() < 2
    assert np.abs(first - last).max() > 100


def test_gif_of_no_step(tmp_path):
    rules = make_rules()
    write_gif(filmed(np.zeros((0, 4), int), rules), tmp_path / "game.gif", width=300)
    with Image.open(tmp_path / "game.gif") as gif:
        assert gif.n_frames == 1


def test_window(monkeypatch):
    pygame = pytest.importorskip("pygame", reason="pygame is not installed: pip install -e '.[human]'")
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    state, rules = start()
    window = Window(rules, 400)
    window.close()
    window = Window(rules, 400)
    window.show(state, 0)
    shown = pygame.surfarray.array3d(pygame.display.get_surface()).swapaxes(0, 1)
    np.testing.assert_array_equal(shown, frame(state, 0, rules, 400))
    pygame.event.post(pygame.event.Event(pygame.QUIT))
    window.show(state, 0)
    assert not pygame.display.get_init()
    window.show(state, 0)  # and it stays closed
    assert not pygame.display.get_init()
    window.close()


def test_window_without_pygame():
    program = (
        "import sys; sys.modules['pygame'] = None\n"
        "from mctf.render import Window\n"
        "from mctf.rules import make_rules\n"
        "Window(make_rules())"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, env=os.environ, check=False)
    assert done.returncode == 1
    assert "pip install 'berteam-cli[human]'" in done.stderr
