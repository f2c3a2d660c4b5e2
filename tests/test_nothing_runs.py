"""Nothing runs that was only loaded: hostile run folders, files and names, against the real commands.

Everything hostile here would make a file of the name MARK if it ran.
"""

import ast
import csv
import hashlib
import json
import pickle
import re
import shutil
import struct
import subprocess
import sys
import zipfile
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
import torch
from safetensors.torch import load_file, save_file

from berteam_cli import checkpoint, cli
from berteam_cli.reading import last_state
from berteam_cli.stored import plain_config
from tests.command.conftest import BERTEAM
from tests.command.conftest import berteam as berteam  # noqa: PLC0414 (a fixture)

MARK = "it_ran"
ROOT = Path(__file__).parent.parent
WORDS = ["epochs=1", "games_per_epoch=4", "evaluation.games=0", "record_every=1", "team_size=1"]
RUNS = {
    "learners": ["env=rps", "population=ppo6", "learner.n_steps=16", "learner.minibatch_size=8", *WORDS],
    "sailors": ["population=fixed_policies", "optimizer=fixed", "selector=uniform", "env.max_time_s=10", *WORDS],
    "hands": ["env=rps", "population=hands", "optimizer=fixed", "selector=uniform", *WORDS],
}
RUNS["learners"] += ["selector.width=8", "selector.heads=2", "selector.layers=1"]
FEW = ["games_per_pair=1", "replay_games=1", "aggression_games=1", "payoff_games=1"]
READERS = {
    "resume": lambda run: ["resume", run, "epochs=2"],
    "evaluate": lambda run: ["evaluate", run, *FEW],
    "compare": lambda run: ["compare", run, "other", "games=20", "reference_games=10", "out=c"],
    "tournament": lambda run: ["tournament", f"run={run}", "top=3", "games_per_pair=2", "out=t"],
    "replay": lambda run: ["replay", run, "blue=0", "red=1", "out=game.html"],
    "export": lambda run: ["export", run, "agent=0", "out=a.zip"],
    "inspect": lambda run: ["inspect", run],
}


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    """Small runs, to be copied before they are changed."""
    place = tmp_path_factory.mktemp("kept")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["berteam"])
        for name, words in RUNS.items():
            cli.run("train", [*words, f"out={place / name}"])
    return place


@pytest.fixture
def run(kept, tmp_path):
    """Copies a run to where the command works, and returns its folder."""

    def copied(kind, name="run"):
        return Path(shutil.copytree(kept / kind, tmp_path / name)).relative_to(tmp_path)

    return copied


def changed(folder, old, new):
    """Changes the config in a run's folder."""
    text = (folder / "config.yaml").read_text()
    assert old in text
    (folder / "config.yaml").write_text(text.replace(old, new))


class Bomb:
    """What makes MARK when it is unpickled."""

    def __reduce__(self):
        return (exec, (f"open({MARK!r}, 'w')",))


def refused(done, code=2):
    """Checks that a command ended in one sentence, and that nothing ran."""
    assert done.stderr.startswith("berteam: ")
    assert done.stderr.count("\n") == 1
    assert done.stderr.rstrip("\n").isprintable()
    assert not Path(MARK).exists()
    return done.stderr


# --- code that a config names ---


@pytest.mark.parametrize("command", READERS)
def test_what_a_run_imports_must_be_named_on_the_command_line(command, run, berteam):
    folder = run("sailors")
    run("sailors", "other")
    changed(folder, "reward: custom_rew2", "reward: strange:pay")
    Path("strange.py").write_text(f"open({MARK!r}, 'w')\ndef pay(terms, before, after):\n    return 1.0\n")
    if command == "inspect":  # it needs no more than the tables, unless a selector is to be searched
        with (folder / "team_distribution.csv").open("a") as table:
            table.write("1,other,0.1,\n")
    before = sorted(Path().rglob("*"))
    words = READERS[command](str(folder))
    assert "add trust=strange:pay to the command" in refused(berteam(*words, code=2))
    assert "add trust=strange:pay to the command" in refused(berteam(*words, "trust=other:pay", code=2))
    assert sorted(Path().rglob("*")) == before
    if command in {"resume", "inspect"}:
        berteam(*words, "trust=strange:pay")
        assert Path(MARK).exists()
        sys.modules.pop("strange")


def test_a_report_says_what_it_did_not_import(run, berteam):
    folder = run("learners")
    changed(folder, "name: rps", "name: pettingzoo\n  target: subprocess:getoutput\n  options: {cmd: 'touch it_ran'}")
    changed(folder, "  sides: 2\n", "  teams: {}\n  max_steps: 9\n  score: reward\n")
    berteam("report", str(folder))
    assert "add trust=subprocess:getoutput to the command" in (folder / "report" / "report.html").read_text()
    assert "add trust=" in refused(berteam("evaluate", str(folder), code=2))
    assert "trust must be module:function" in refused(berteam("evaluate", str(folder), "trust=subprocess", code=2))


def test_going_on_with_ones_own_words_needs_no_trust(run, berteam):
    Path("own.py").write_text("def pay(terms, before, after):\n    return 1.0\n")
    words = [*RUNS["sailors"], "env.reward=own:pay", "out=mine", "on_exists=resume"]
    berteam("train", *words)
    berteam("train", *words, "epochs=2")


def test_figures_go_to_no_address_that_a_folder_names(run, berteam):
    folder = run("hands")
    changed(folder, "name: csv", "name: mlflow\n  experiment: x\n  tracking: http://203.0.113.1")
    said = refused(berteam("resume", str(folder), "epochs=2", code=2))
    assert "add logger.tracking=http://203.0.113.1 to the command, else logger=csv" in said


def test_modules_in_the_folder_one_stands_in_hide_nothing(run, tmp_path):
    folder = tmp_path / run("hands")
    for name in (
        "wandb",
        "mlflow",
        "sb3_contrib",
        "numexpr",
        "bottleneck",
        "pyarrow",
        "IPython",
        "sitecustomize",
        "rps",
    ):
        (folder / f"{name}.py").write_text(f"open({MARK!r}, 'w')\nraise ImportError\n")
    for name in ("json", "numpy", "mctf"):
        (folder / name).mkdir()
        (folder / name / "__init__.py").write_text(f"open({MARK!r}, 'w')\n")
    done = subprocess.run([BERTEAM, "evaluate", ".", *FEW], cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert not (folder / MARK).exists()


# --- config.yaml ---

YAMLS = (
    f'seed: !!python/object/apply:os.system ["touch {MARK}"]',
    f'seed: !!python/object/new:os.system ["touch {MARK}"]',
    "seed: !!python/name:os.system",
    "seed: !!python/object/apply:pathlib.PosixPath [x]",
    "seed: ${oc.env:HOME}",
    "seed: ${oc.create:1}",
    "seed: ${oc.decode:1}",
    "seed: ${hydra:runtime.cwd}",
    "seed: ${epochs}",
    "seed: &a [1, 1]",
    "seed: [" * 3000,
    "a: &a [0,0,0,0,0,0,0,0,0]\n"
    + "".join(f"{y}: &{y} [{','.join(['*' + x] * 9)}]\n" for x, y in zip("abcdefgh", "bcdefghi", strict=True)),
    f"_target_: os.system\n_args_: [touch {MARK}]",
    "- 1",
    "\x00",
    "",
)


@pytest.mark.parametrize("text", YAMLS, ids=lambda text: text[:30])
def test_a_config_in_a_folder_is_values_and_nothing_else(text, run, berteam):
    folder = run("hands")
    config = folder / "config.yaml"
    rest = (
        config.read_text().replace("seed: 0\n", "")
        if text.startswith(("seed: ", "_target_")) and len(text) < 999
        else ""
    )
    config.write_text(f"{rest}{text}\n")
    for command in ("resume", "evaluate", "tournament"):
        assert str(Path.home()) not in refused(berteam(*READERS[command](str(folder)), code=2))


@pytest.mark.parametrize("name", ["../../x", "/tmp/x", "=1+1", "<b>", "\x1b[2J", "a b", "nan", "[red]"])
def test_an_island_in_a_folder_has_a_name_that_tables_and_paths_can_hold(name, run, berteam):
    folder = run("hands")
    changed(folder, "    hands:", f"    {json.dumps(name)}:")
    assert "an island's name must be a word" in refused(berteam("resume", str(folder), "epochs=2", code=2))


@pytest.mark.parametrize(
    "facts",
    [
        {"status": []},
        {"started": {}},
        {"command": "touch"},
        {"resumed": 3},
        {"overrides": {}},
        {"error": []},
        [],
        3,
        "[",
    ],
    ids=str,
)
def test_a_manifest_of_another_kind_is_none(facts, run, berteam):
    folder = run("hands")
    path = folder / "manifest.json"
    said = {**json.loads(path.read_text()), **facts} if isinstance(facts, dict) else facts
    path.write_text("[" * 100_000 if facts == "[" else json.dumps(said))
    for words in (["inspect", "run"], ["report", "run"], ["resume", "run"]):
        assert "run is no folder of a run" in refused(berteam(*words, code=2))


# --- checkpoints ---


def checkpoint_of(folder):
    (place,) = (folder / "checkpoint").glob("epoch_*1")
    shutil.rmtree(folder / "checkpoint" / "epoch_00000000")
    return place


def signed(place):
    """Makes the checksum of a changed checkpoint right again, as whoever changed it would."""
    said = json.loads((place / "state.json").read_text())
    said["sha256"] = checkpoint.digest(place / "tensors.safetensors")
    (place / "state.json").write_text(json.dumps(said))


def header(entries, data=b""):
    text = json.dumps(entries).encode()
    return struct.pack("<Q", len(text)) + text + data


def entry(dtype="F32", shape=(1,), offsets=(0, 4)):
    return {"population.fitness": {"dtype": dtype, "shape": list(shape), "data_offsets": list(offsets)}}


def pickled(tmp_path):
    torch.save({"weights": Bomb()}, tmp_path / "bomb.pt")
    return (tmp_path / "bomb.pt").read_bytes()


TENSORS = {
    "pickle": lambda place: pickle.dumps(Bomb()),
    "torch": pickled,
    "huge header": lambda place: struct.pack("<Q", 2**63) + b"{}",
    "a header longer than the file": lambda place: struct.pack("<Q", 10**6) + b"{}",
    "overlapping": lambda place: header({**entry(), "b": entry(offsets=(2, 6))["population.fitness"]}, b"\0" * 6),
    "behind the end": lambda place: header(entry(offsets=(0, 2**40), shape=(2**38,))),
    "backwards": lambda place: header(entry(offsets=(4, 0)), b"\0" * 4),
    "negative": lambda place: header(entry(shape=(-1,)), b"\0" * 4),
    "overflowing": lambda place: header(entry(shape=(2**32, 2**32, 2**32)), b"\0" * 4),
    "no such type": lambda place: header(entry(dtype="O"), b"\0" * 4),
    "other names": lambda place: header(entry(), b"\0" * 4),
    "nested": lambda place: struct.pack("<Q", 200_000) + b"[" * 200_000,
    "nothing": lambda place: b"",
}


@pytest.mark.parametrize("kind", TENSORS)
def test_tensors_that_are_none(kind, run, berteam, tmp_path):
    folder = run("hands")
    place = checkpoint_of(folder)
    (place / "tensors.safetensors").write_bytes(TENSORS[kind](tmp_path))
    signed(place)
    for command, code in (("resume", 3), ("evaluate", 2)):
        assert "no checkpoint to go on from" in refused(berteam(*READERS[command](str(folder)), code=code), code)


def twisted(tensor, way):
    """Returns another tensor for ``tensor``, None where that way makes no difference."""
    if way == "type":
        return tensor.to(torch.int32 if tensor.dtype.is_floating_point else torch.float64)
    if way == "axis":
        return tensor.reshape(*tensor.shape, 1).repeat(*[1] * tensor.ndim, 2) if tensor.ndim else None
    if way == "short":
        return tensor[:-1].clone() if tensor.ndim and len(tensor) else None
    if way == "long":
        return torch.cat([tensor, tensor]) if tensor.ndim and len(tensor) else None
    if tensor.dtype not in {torch.int64, torch.int16} or not tensor.numel():
        return None
    return torch.full_like(tensor, 30_000 if way == "large" else -30_000)


@pytest.mark.parametrize("way", ["type", "axis", "short", "long", "large", "small"])
def test_tensors_that_compiled_games_and_updates_could_not_take_are_refused(way, run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    folder = run("learners")
    place = checkpoint_of(folder)
    tensors, harmless, tried = load_file(place / "tensors.safetensors"), [], 0
    for name, tensor in tensors.items():
        other = twisted(tensor, way)
        if other is None:
            continue
        tried += 1
        save_file(tensors | {name: other}, place / "tensors.safetensors")
        signed(place)
        try:
            last_state(folder)
        except cli.InputError as error:
            assert "no checkpoint to go on from" in str(error)
        else:
            harmless.append(name)
    assert tried > (5 if way in {"large", "small"} else 20)
    # What remains is kept by numpy or torch, which do look at bounds, or is a count.
    counts = (
        "steps",
        "pushed",
        "epochs",
        "updates",
        "filled",
        "collected",
        "age",
        "games",
        "parent",
        "failed",
        "lengths",
    )
    assert [name for name in harmless if not name.startswith("selector.winners.") and not name.endswith(counts)] == []


@pytest.mark.parametrize(
    "facts",
    [
        {"epoch": "1"},
        {"epoch": -1},
        {"played": 1e9},
        {"seconds": "x"},
        {"table_sizes": []},
        {"table_sizes": {"games": -5}},
    ],
    ids=str,
)
def test_a_state_of_another_kind_is_none(facts, run, berteam):
    folder = run("hands")
    path = checkpoint_of(folder) / "state.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), **facts}))
    assert "no checkpoint to go on from" in refused(berteam("resume", "run", "epochs=2", code=3), 3)


def test_a_pickle_in_a_tables_or_a_sheets_place_is_none(run, berteam):
    folder = run("hands")
    for name in ("elo", "agents", "team_distribution", "summary"):
        (folder / f"{name}.csv").write_bytes(pickle.dumps(Bomb()))
    for words in (["inspect", "run"], ["report", "run"]):
        assert "cannot be read as a table" in refused(berteam(*words, code=2))
    (folder / "evaluation").mkdir()
    for name in ("played.games", "played.json", "payoffs.games", "payoffs.json"):
        (folder / "evaluation" / name).write_bytes(pickle.dumps(Bomb()))
    berteam("evaluate", "run", *FEW)
    assert not Path(MARK).exists()


def test_files_that_a_run_folder_names_are_not_read_again(run, berteam):
    folder = run("hands")
    changed(folder, "members: []", "members:\n  - {file: evil.zip, name: evil, trust: true}")
    with zipfile.ZipFile("evil.zip", "w") as archive:
        archive.writestr("data", json.dumps({"policy_class": {":serialized:": "gASV"}}))
        archive.writestr("policy.pth", pickle.dumps(Bomb()))
    for command, code in (("resume", 3), ("evaluate", 2), ("export", 2)):
        assert "no checkpoint to go on from" in refused(berteam(*READERS[command]("run"), code=code), code)
    words = [*RUNS["hands"], "population=imported", "population.members=[{file: evil.zip}]", "out=new"]
    assert "population.members[0].file=evil.zip" in refused(berteam("train", *words, code=2))


# --- links ---


@pytest.mark.parametrize(
    "name",
    ["log.txt", "config.yaml", "manifest.json", "games.csv", "evaluation", "report", "checkpoint", "checkpoint/part"],
)
def test_nothing_is_read_or_written_through_a_link_out_of_the_folder(name, run, berteam, tmp_path):
    folder = run("hands")
    outside = tmp_path / "outside"
    if (folder / name).is_file():
        shutil.copy(folder / name, outside)
    elif (folder / name).is_dir():
        shutil.copytree(folder / name, outside)
    else:
        outside.mkdir()
    if (folder / name).is_dir():
        shutil.rmtree(folder / name)
    (folder / name).unlink(missing_ok=True)
    (folder / name).symlink_to(outside)

    def state():
        return {path: path.read_bytes() for path in (outside, *outside.rglob("*")) if path.is_file()}

    before = state()
    for words in (["resume", "run", "epochs=2"], ["evaluate", "run", *FEW], ["report", "run"], ["inspect", "run"]):
        assert f"{name} is a link out of the run's folder" in refused(berteam(*words, code=2))
    words = [*RUNS["hands"], "out=run", "on_exists=overwrite"]
    assert f"{name} is a link out of the run's folder" in refused(berteam("train", *words, code=2))
    assert state() == before


def test_a_run_may_be_reached_by_a_link(run, berteam):
    run("hands")
    Path("latest").symlink_to("run")
    Path("run", "newest.csv").symlink_to("games.csv")
    berteam("resume", "latest", "epochs=2")
    Path("run", "loop").symlink_to("loop")
    assert "loop is a link out of the run's folder" in refused(berteam("inspect", "latest", code=2))


# --- names ---

NAMES = (
    "=HYPERLINK(1)",
    "+1",
    "-1+cmd|' /C calc'!A0",
    "@SUM(1)",
    "a;=1+1",
    "\x1b[2J\x1b]0;x\x07",
    "a\nb",
    "[red]x[/red]",
    "<b>&\"'",
)


def test_names_of_folders_are_no_formulas_and_no_orders_to_a_terminal(run, berteam):
    folders = [str(run("hands", name)) for name in NAMES]
    joined = ",".join("'" + name.replace("'", "\\'") + "'" for name in folders)
    words = ["tournament", f"run=[{joined}]", "top=1", "games_per_pair=2", "out=t"]
    out = berteam(*words).stdout + berteam("inspect", "t").stdout
    out += berteam("compare", *(f"./{name}" for name in folders), "games=40", "reference_games=10", "out=c").stdout
    for name in folders:
        out += berteam("inspect", f"./{name}").stdout
    assert "[red]x[/red]" in out
    assert all(line.isprintable() for line in out.split("\n"))
    for path in (*Path("t").glob("*.csv"), *Path("c").glob("*.csv")):
        with path.open(newline="") as file:
            cells = [cell for row in csv.reader(file) for cell in row]
        texts = [cell for cell in cells if not re.fullmatch(r"-?[0-9.e+-]+|-inf|", cell)]
        assert all(cell.isprintable() and not re.search(r"(^|;)[=+@-]", cell) for cell in texts), path


class Tags(HTMLParser):
    """Collects the tags of a page, and those of pages in it."""

    def __init__(self, page):
        super().__init__()
        self.tags, self.attributes = [], []
        self.feed(page)

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        for name, value in attributes:
            if name == "srcdoc":
                self.tags += Tags(value).tags
            self.attributes.append(name)


EVIL = '</script></pre></title>"><script>evil()</script><img src=x onerror=evil()>${x}<!--BODY-->'


def test_no_name_is_a_tag_on_a_page(run, berteam):
    folder = run("sailors")
    berteam("replay", str(folder), "blue=0", "red=1", "out=plain.html")
    berteam("report", str(folder))
    plain = [Tags(path.read_text()).tags for path in (folder / "report" / "report.html", Path("plain.html"))]
    manifest = json.loads((folder / "manifest.json").read_text())
    manifest |= {"command": ["berteam", EVIL], "started": EVIL, "overrides": [EVIL], EVIL: EVIL, "resumed": [EVIL]}
    (folder / "manifest.json").write_text(json.dumps(manifest))
    changed(folder, "logger:", f"# {EVIL}\nlogger:")
    for table in ("agents", "team_distribution"):
        text = (folder / f"{table}.csv").read_text()
        (folder / f"{table}.csv").write_text(text.replace("attack_hard", f'"{EVIL}"'.replace('">', '"">')))
    other = folder.rename(EVIL.replace("/", "\u2215").replace("\u2215script", "script")[:200])
    berteam("report", str(other), "out=page")
    berteam("replay", str(other), "blue=0", "red=1", "out=evil.html")
    evil = [Tags(path.read_text()) for path in (Path("page", "report.html"), Path("evil.html"))]
    assert [page.tags for page in evil] == plain
    assert not any(name.startswith("on") for page in evil for name in page.attributes)


# --- the code itself ---

SOURCES = [path for place in ("berteam_cli", "envs") for path in sorted((ROOT / place).rglob("*.py"))]
NEVER = {"pickle", "cPickle", "_pickle", "marshal", "shelve", "dill", "cloudpickle", "joblib", "jsonpickle"}


def test_the_code_knows_no_pickle_and_no_eval():
    loads = []
    for path in SOURCES:
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import | ast.ImportFrom):
                names = {alias.name.partition(".")[0] for alias in node.names} | {getattr(node, "module", None) or ""}
                assert not names & NEVER, path
            if not isinstance(node, ast.Call):
                continue
            called = ast.unparse(node.func)
            assert called not in {
                "eval",
                "exec",
                "compile",
                "os.system",
                "os.popen",
                "yaml.load",
                "yaml.unsafe_load",
            }, path
            assert not called.startswith(("pd.read_pickle", "subprocess.")), path
            if called in {"torch.load", "np.load"}:
                loads.append((called, {word.arg: ast.unparse(word.value) for word in node.keywords}))
            if called.endswith("load_from_zip_file"):
                assert path.name == "trusted.py"
    assert sorted(called for called, _ in loads) == ["np.load", "torch.load"]
    for called, words in loads:
        assert words.get("weights_only", words.get("allow_pickle")) == ("True" if called == "torch.load" else "False")


def test_a_table_of_objects_is_no_recording(tmp_path, monkeypatch):
    from mctf.recording import TraceError, read  # noqa: PLC0415

    monkeypatch.chdir(tmp_path)
    np.savez("bomb.npz", meta=np.array([Bomb()], dtype=object))
    Path("bomb.npy").write_bytes(pickle.dumps(Bomb()))
    for name in ("bomb.npz", "bomb.npy"):
        with pytest.raises(TraceError):
            read(Path(name))
    assert not Path(MARK).exists()


def test_a_config_of_a_run_reads_as_it_was_written(kept):
    text = (kept / "learners" / "config.yaml").read_text()
    assert hashlib.sha256(text.encode()).hexdigest()
    assert plain_config(kept / "learners").selector.name == "berteam"
