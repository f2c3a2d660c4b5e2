"""The page is one file that plays the film, in a real browser."""

import json
import re

import numpy as np
import pytest

from mctf.film import filmed, result, said
from mctf.kernel import RED_WON, RUNNING, TIED, TIME_OUT
from mctf.page import write_page
from mctf.render import clock
from mctf.rules import make_rules
from tests.browser import needs_chromium, opened
from tests.mctf.films import DUEL, film_of

EVIL = '</script><script>document.body.dataset.evil = 1</script><!-- & "\u2028 /*SCRIPT*/ ünï'


@pytest.fixture(scope="module")
def film():
    return film_of(*DUEL)


@pytest.fixture(scope="module")
def page(film, tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "game.html"
    write_page(film, path, [f"{v} {name}" for v, name in enumerate(DUEL)], "A duel")
    return path


def told(path):
    return json.loads(re.search(r"^const film = (.*);$", path.read_text(), re.MULTILINE)[1])


def test_it_needs_nothing_else(page):
    content = page.read_text()
    assert not re.search(r"https?:|//[a-z]|\bsrc=|<link|@import|url\(|fetch\(|XMLHttpRequest", content)
    assert "default-src 'none'" in content
    assert not re.search(r"/\*(STYLE|SCRIPT|FILM)\*/", content)
    assert page.stat().st_size < 100_000


@pytest.mark.parametrize(
    ("end", "said"), [(RED_WON, "Red wins"), (TIED, "It is a draw"), (TIME_OUT, "It is a draw"), (RUNNING, "")]
)
def test_who_won_is_what_the_rules_say(film, tmp_path, end, said):
    level = film._replace(score=np.zeros_like(film.score), end=end)  # as many captures on either side
    write_page(level, tmp_path / "game.html", [""] * len(DUEL), "")
    assert told(tmp_path / "game.html")["result"] == said
    assert end == RUNNING or result(level) == said


def test_the_numbers_are_the_films(page, film):
    data, vehicles = told(page), len(DUEL)
    assert data["frames"] == len(film.time)

    def of(name, width):
        return np.cumsum(np.reshape(data[name], (-1, width)), axis=0)

    np.testing.assert_allclose(of("pos", 2 * vehicles).reshape(film.pos.shape) / 100, film.pos, atol=0.00501)
    np.testing.assert_allclose(of("heading", vehicles), film.heading, atol=0.501)
    np.testing.assert_array_equal(of("status", vehicles) & 1 > 0, film.has_flag)
    np.testing.assert_array_equal(of("status", vehicles) & 2 > 0, film.is_tagged)
    np.testing.assert_array_equal(of("score", 6).reshape(film.score.shape), film.score)
    assert [event[3] for event in data["events"]] == [said(event, film.rules) for event in film.events]


def test_names_must_be_as_many_as_vehicles(film, tmp_path):
    with pytest.raises(ValueError, match="names must be 4, one for each vehicle, but are 3"):
        write_page(film, tmp_path / "game.html", ["a", "b", "c"], "")
    assert list(tmp_path.iterdir()) == []


def number(tab):
    return int(tab.ask("document.body.dataset.frame"))


def written(tab, place):
    return tab.ask(f"document.querySelector({place!r}).textContent")


def pixels(tab):
    return tab.ask("document.getElementById('field').toDataURL()")


@needs_chromium
def test_in_a_browser(page, film, tmp_path):
    last = len(film.time) - 1
    grab = next(event for event in film.events if event.kind == "grab")
    with opened(f"{page.as_uri()}#t=30", tmp_path) as tab:
        # At first: who plays, what happened, and the asked moment
        assert tab.ask("document.title") == written(tab, "h1") == "A duel"
        assert number(tab) == 30
        assert written(tab, "#clock") == "0:30"
        assert written(tab, "#result") == "of 7:00"
        assert tab.ask("document.body.dataset.playing") == "false"
        assert [name in written(tab, side) for side in ("#blue", "#red") for name in ("0 attack", "3 defend")] == [
            *(True, False),
            *(False, True),
        ]
        events = tab.ask("[...document.querySelectorAll('#events button')].map(x => x.textContent)")
        assert events == [f"{clock(film.time[event.frame])}{said(event, film.rules)}" for event in film.events]

        # An event takes us there, and the board says so
        before = pixels(tab)
        tab.ask(f"document.querySelectorAll('#events button')[{film.events.index(grab)}].click()")
        assert number(tab) == grab.frame
        assert pixels(tab) != before
        assert "flag" in written(tab, ("#blue", "#red")[grab.vehicle // 2])
        assert written(tab, "[aria-current] span") == said(grab, film.rules)

        # Keys
        tab.press("ArrowRight", 39)
        assert number(tab) == grab.frame + 1
        tab.press("ArrowLeft", 37)
        tab.press("ArrowLeft", 37, shift=True)
        assert number(tab) == grab.frame - 10
        tab.press("ArrowUp", 38)
        assert tab.ask("document.getElementById('speed').value") == "16"
        tab.press("Home", 36)
        assert number(tab) == 0
        tab.press("ArrowLeft", 37)
        assert number(tab) == 0
        tab.press("End", 35)
        assert number(tab) == last
        assert written(tab, "#result") == "Blue wins"
        assert written(tab, "#blue .captures") == "1"

        # The slider, then playing to the end, where it stops
        tab.ask(f"(scrub => {{ scrub.value = {last - 8}; scrub.dispatchEvent(new Event('input')) }})(byId('scrub'))")
        assert number(tab) == last - 8
        tab.press(" ", 32)
        tab.until(f"+document.body.dataset.frame > {last - 8}")
        tab.until("document.body.dataset.playing === 'false'")
        assert number(tab) == last
        tab.press(" ", 32)  # from its beginning again, and stop
        tab.press(" ", 32)
        assert tab.ask("document.body.dataset.playing") == "false"
        assert number(tab) < last

        # The address
        tab.ask("location.hash = '#t=100.4'")
        tab.until("document.body.dataset.frame === '100'")
        tab.ask("location.hash = '#t=1e9'")
        tab.until(f"document.body.dataset.frame === '{last}'")
        assert tab.errors == []
        assert tab.asked == [f"{page.as_uri()}#t=30".split("#")[0]]


@needs_chromium
def test_between_two_steps_vehicles_are_between(page, film, tmp_path):
    with opened(page.as_uri(), tmp_path) as tab:
        places = [tab.ask(f"placed(0, {t}).place") for t in (20, 20.25, 21)]
        np.testing.assert_allclose(places[1], 0.75 * np.array(places[0]) + 0.25 * np.array(places[2]))
        scale = tab.ask("scale")
        moved = np.subtract(places[2], places[0]) / scale
        np.testing.assert_allclose(moved * (1, -1), film.pos[21, 0] - film.pos[20, 0], atol=0.011)
        # the short way round: over 180 deg, not back through north
        frame = int(np.argmax(np.abs(np.diff(film.heading[:, 0])) > 300.0))
        assert np.abs(np.diff(film.heading[:, 0]))[frame] > 300.0
        turned = np.diff([tab.ask(f"placed(0, {frame + share}).course") for share in (0, 0.5, 0.999)])
        assert (np.abs(turned) < np.pi / 4).all()


@needs_chromium
@pytest.mark.parametrize(("dark", "size"), [(True, "1280,800"), (False, "420,800")])
def test_dark_and_narrow(page, dark, size, tmp_path):
    with opened(f"{page.as_uri()}#t=60", tmp_path, f"--window-size={size}") as tab:
        plain = pixels(tab)
        if dark:
            tab.send("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": "dark"}])
            tab.until("getComputedStyle(document.body).backgroundColor === 'rgb(18, 24, 29)'")
            tab.until("colors.pole === '#dfe6ec'")
            assert pixels(tab) != plain
        assert tab.ask("document.documentElement.scrollWidth <= innerWidth")
        assert tab.errors == []


@needs_chromium
def test_names_do_no_harm(tmp_path):
    rules = make_rules(team_size=[1, 2], max_time_s=5.0)
    film = filmed(np.full((5, 3), 16), rules)
    write_page(film, tmp_path / "game.html", [EVIL, "<b>bold</b>", ""], EVIL)
    with opened((tmp_path / "game.html").as_uri(), tmp_path) as tab:
        assert tab.ask("document.body.dataset.evil") is None
        assert written(tab, "h1") == EVIL
        assert EVIL in written(tab, "#blue li")
        assert "<b>bold</b>" in written(tab, "#red li")
        assert "Nothing happened" in written(tab, "#events")
        tab.press("End", 35)
        assert written(tab, "#result") == "It is a draw"
        assert tab.errors == []


@needs_chromium
def test_one_frame(tmp_path):
    film = filmed(np.zeros((0, 4), int), make_rules())
    write_page(film, tmp_path / "game.html", [""] * 4, "start")
    with opened(f"{(tmp_path / 'game.html').as_uri()}#play", tmp_path) as tab:
        tab.until("document.body.dataset.playing === 'false'")
        assert number(tab) == 0
        assert written(tab, "#result") == "of 7:00"  # it is not over
        assert tab.errors == []
