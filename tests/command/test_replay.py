"""berteam replay: the files it leaves, and what it refuses."""

import json
import re

import pytest
from PIL import Image

from berteam_cli.command.replay import checked_film, played, players, strongest
from berteam_cli.config import checked
from berteam_cli.errors import InputError, RunError
from berteam_cli.records import COLUMNS
from mctf.scripted import NAMES
from tests.browser import needs_chromium, opened
from tests.command.conftest import BERTEAM, TINY
from tests.test_config import composed

SHORT = "env.max_time_s=30"


def film_in(path):
    return json.loads(re.search(r"^const film = (.*);$", path.read_text(), re.MULTILINE)[1])


@pytest.fixture
def run(berteam, tmp_path):
    """A trained run of six members, in folder ``run``."""
    berteam("train", "population=ppo6", *TINY, "selector=mcaa", "evaluation.games=300", "out=run")
    return tmp_path / "run"


def test_fixed_policies(berteam, tmp_path):
    said = berteam("replay", "blue=2-5", "red=attack_easy-3", "seed=4", "out=game", "format=both").stdout
    first, ended, *last = said.splitlines()
    assert first == (
        "Fixed policies: blue 2-5 (attack_hard + defend_hard) against red 0-3 (attack_easy + defend_easy), seed 4."
    )
    assert re.fullmatch(r"Blue wins, 1 to 0, after \d:\d\d \(\d+ steps\)\.", ended)
    assert last == ["Files in .: game.html, game.gif", "Next: open game.html in a browser"]
    assert {path.name for path in tmp_path.iterdir()} == {"game.html", "game.gif"}
    film = film_in(tmp_path / "game.html")
    assert film["names"] == ["2 attack_hard", "5 defend_hard", "0 attack_easy", "3 defend_easy"]
    assert film["frames"] == int(re.search(r"\((\d+) steps", ended)[1]) + 1
    assert film["events"][-1][2:] == ["capture", "blue 0 captures the flag"]
    with Image.open(tmp_path / "game.gif") as gif:
        assert gif.n_frames > 50


def test_files_have_names_of_their_own(berteam, tmp_path):
    for _ in range(2):
        berteam("replay", "blue=0", "red=6", "team_size=1", SHORT)
    folders = list((tmp_path / "outputs" / "replay").iterdir())
    assert len(folders) == 2
    assert [[path.name for path in folder.iterdir()] for folder in folders] == [["0_6.html"]] * 2


def test_a_run(berteam, run, tmp_path):
    config = (run / "config.yaml").read_bytes()
    best, second = (line.split(",")[0] for line in (run / "elo.csv").read_text().splitlines()[1:3])
    said = berteam("replay", "run").stdout.splitlines()
    assert said[0].startswith(
        f"run after epoch 4: blue {best} (main.{best[0]} + main.{best[2]}) against red {second} ("
    )
    assert said[3] == f"Next: open run/replay/{best}_{second}.html in a browser"
    assert film_in(run / "replay" / f"{best}_{second}.html")["limit"] == 30.0

    # Which of the strongest is not the other; the order of the members is kept
    assert f"blue {second} (" in berteam("replay", "run", f"red={best}").stdout
    said = berteam("replay", "run", "blue=5-1", "red=3-3", "seed=2").stdout.splitlines()
    assert said[2] == "Files in run/replay: 5-1_3-3.html"
    film = film_in(run / "replay" / "5-1_3-3.html")
    assert film["names"] == ["5 main.5", "1 main.1", "3 main.3", "3 main.3"]

    # The same seed gives the same file, another seed another game
    once = (run / "replay" / "5-1_3-3.html").read_bytes()
    berteam("replay", "run=run", "blue=5-1", "red=3-3", "seed=2", "out=again.html")
    assert (tmp_path / "again.html").read_bytes() == once
    berteam("replay", "run", "blue=5-1", "red=3-3", "seed=3", "out=other")
    assert film_in(tmp_path / "other.html")["pos"] != film["pos"]

    # A file is not lost by accident
    refused = berteam("replay", "run", "blue=5-1", "red=3-3", code=2).stderr
    assert refused == (
        "berteam: run/replay/5-1_3-3.html exists already; "
        "name another file with out=FILE, or say on_exists=overwrite.\n"
    )
    assert (run / "replay" / "5-1_3-3.html").read_bytes() == once
    berteam("replay", "run", "blue=5-1", "red=3-3", "seed=3", "on_exists=overwrite")
    assert (run / "replay" / "5-1_3-3.html").read_bytes() == (tmp_path / "other.html").read_bytes()
    assert not list(tmp_path.rglob("*.part"))
    assert (run / "config.yaml").read_bytes() == config

    # And a run may have a name that Hydra would not read
    odd = tmp_path / "a run, it's = [odd]"
    run.rename(odd)
    berteam("replay", odd.name, "blue=0-0", "red=1-1")
    assert (odd / "replay" / "0-0_1-1.html").exists()


def test_a_team_of_a_run_against_fixed_policies(berteam, run, tmp_path):
    best = (run / "elo.csv").read_text().splitlines()[1].split(",")[0]
    said = berteam("replay", "run", "red=attack_hard-defend_hard").stdout.splitlines()
    assert "against red attack_hard-defend_hard (attack_hard + defend_hard), seed 0." in said[0]
    assert said[2] == f"Files in run/replay: {best}_attack_hard-defend_hard.html"
    film = film_in(run / "replay" / f"{best}_attack_hard-defend_hard.html")
    assert film["names"][2:] == ["attack_hard", "defend_hard"]

    # Both are who they are called: fixed policies play as without the run, members as in it
    berteam("replay", "blue=attack_hard-5", "red=4-0", SHORT, "out=fixed.html")
    berteam("replay", "run", "blue=attack_hard-defend_hard", "red=defend_medium-attack_easy", "out=same.html")
    assert film_in(tmp_path / "same.html")["pos"] == film_in(tmp_path / "fixed.html")["pos"]
    berteam("replay", "run", "blue=4-random", "red=2-2", "out=mixed.html")
    assert film_in(tmp_path / "mixed.html")["names"] == ["4 main.4", "random", "2 main.2", "2 main.2"]


def test_a_run_that_rated_nothing(berteam, run):
    (run / "elo.csv").unlink()
    assert "rated too few teams to choose one" in berteam("replay", "run", code=2).stderr
    berteam("replay", "run", "blue=0-1", "red=1-2")
    for folder in (run / "checkpoint").iterdir():
        (folder / "tensors.safetensors").unlink()
    assert "has no checkpoint" in berteam("replay", "run", "blue=0-1", "red=1-2", code=3).stderr


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["blue=2-5"], "red must name a team when no run is given, such as red=0-1"),
        ([], "blue must name a team when no run is given"),
        (["blue=2-5-1", "red=0-1"], "blue must be 2 members joined by hyphens, such as 0-1, but '2-5-1' is 3"),
        (
            ["blue=2-5", "red=0-16"],
            "A member of red must be one of 0 to 15, or attack_competition_easy, .*, but is '16'",
        ),
        (["blue=2-5", "red=0-"], "A member of red must be one of 0 to 15, or attack_competition_easy, .*, but is ''"),
        (["blue=2-atack_hard", "red=0-1"], "A member of blue must be one of .*Did you mean attack_hard"),
        (["blue=0-1", "red=0-1", "format=mp4"], "format must be one of both, gif, html, but is 'mp4'"),
        (["blue=0-1", "red=0-1", "out=x.gif"], "out=x.gif does not go with format=html"),
        (["blue=0-1", "red=0-1", "out=x.html", "format=both"], "out=x.html does not go with format=both"),
        (["blue=0-1", "red=0-1", SHORT, "out=/proc/none/x"], "/proc/none/x.html cannot be written"),
        (["blue=0-1", "red=0-1", "on_exists=resume"], "on_exists must be one of error, overwrite"),
        (["blue=0-1", "red=0-1", "-m"], "takes no --multirun"),
        (["bleu=0-1", "red=0-1"], "bleu is no key of this configuration. Did you mean blue"),
        (
            ["env=rps", "blue=0-1", "red=0-1"],
            "Only games of env=mctf and .* can be filmed, but this one is env=rps",
        ),
        (["nowhere"], "nowhere is no folder of a run"),
        (["nowhere", "run=elsewhere"], "The run is named twice"),
        (["run=nowhere", "team_size=3"], "team_size has no effect with run=nowhere"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_wrong_input(words, said, berteam, tmp_path):
    error = berteam("replay", *words, code=2).stderr
    assert re.search(said, error), error
    assert error.count("\n") == 1
    assert error.startswith("berteam: ")
    assert list(tmp_path.iterdir()) == []


def test_wrong_members_of_a_run(berteam, run):
    for given in ("6", "main.0"):
        said = berteam("replay", "run", f"blue=0-{given}", "red=0-1", code=2).stderr
        assert "A member of blue must be one of 0 to 5, or attack_competition_easy, " in said
        assert said.endswith(f", waypoint, but is {given!r}.\n")
    said = berteam("replay", "run", "red=defend-0", code=2).stderr
    assert said.endswith(", but is 'defend'. Did you mean defend_hard?\n")
    assert "must be 2 members" in berteam("replay", "run", "red=1", code=2).stderr
    assert not (run / "replay").exists()


def test_help_and_config(berteam):
    said = berteam("replay", "--help").stdout
    assert said.startswith("berteam replay [RUN]")
    for place, name in enumerate(NAMES[:7]):
        assert f"{name} {place}" in said
    assert "on_exists: error" in berteam("replay", "blue=0-1", "--cfg", "job").stdout
    assert re.search("replay +one game", berteam("--help").stdout)


def test_default_teams(tmp_path):
    rows = ["2-5", "0-2", "1-1"]
    table = [",".join(COLUMNS["elo"]), *(f"{team},,{1},{0},{2},4,1,1,2,0.1,{k},,,,"
             for k, team in enumerate(rows, start=1))]  # fmt: skip
    (tmp_path / "elo.csv").write_text("\n".join(table) + "\n")
    assert strongest(tmp_path, None, None) == ("2-5", "0-2")
    assert strongest(tmp_path, "0-2", None) == ("0-2", "2-5")
    assert strongest(tmp_path, None, "2-5") == ("0-2", "2-5")
    assert strongest(tmp_path, "5-2", None) == ("5-2", "0-2")  # the same team, not against itself
    assert strongest(tmp_path, "9-9", "8-8") == ("9-9", "8-8")
    with pytest.raises(InputError, match="rated too few teams"):
        strongest(tmp_path / "empty", None, "1-1")


def test_a_game_that_does_not_come_out_the_same_is_no_film():
    match = players(checked(composed("blue=2-5", "red=0-3", command="replay")))
    game = match.env
    outcomes, experience = played(match, 1)
    film = checked_film(game, outcomes, experience)
    assert len(film.time) == outcomes.steps[0] + 1
    outcomes.steps[0] -= 1
    with pytest.raises(RunError, match="did not come out the same"):
        checked_film(game, outcomes, experience)
    outcomes.steps[0] += 1
    experience.actions[0, 0, :] = 16
    with pytest.raises(RunError, match="did not come out the same"):
        checked_film(game, outcomes, experience)


@needs_chromium
def test_the_page_opens(process, tmp_path):
    assert BERTEAM.exists()
    process("replay", "blue=2-5", "red=0-3", "out=game")
    with opened(f"{(tmp_path / 'game.html').as_uri()}#t=9999", tmp_path) as tab:
        assert tab.ask("document.getElementById('result').textContent") == "Blue wins"
        assert tab.ask("document.title").startswith("Fixed policies: blue 2-5")
        assert tab.errors == []
