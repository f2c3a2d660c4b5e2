"""What lies in a run's folder beside its numbers: its config, its manifest, links."""

import json
import shutil
import threading
from pathlib import Path

import pytest

from berteam_cli.folder import check_links
from tests.hostile.conftest import MARK, READERS, RUNS, changed, refused

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


@pytest.mark.parametrize("k", range(len(YAMLS)), ids=lambda k: YAMLS[k][:30])
def test_a_config_in_a_folder_is_values_and_nothing_else(k, run, berteam):
    folder, text = run("hands"), YAMLS[k]
    config = folder / "config.yaml"
    written = config.read_text()
    assert "\nseed: 0\n" in f"\n{written}"
    added = text.startswith(("seed: ", "_target_")) and len(text) < 999
    config.write_text(f"{written.replace('seed: 0', text) if added else text}\n")
    command = ("resume", "evaluate", "tournament")[k % 3]
    said = refused(berteam(*READERS[command](str(folder)), code=2))
    assert str(Path.home()) not in said
    if added and text.startswith("seed"):
        assert "has a tag, an alias or an interpolation, and no value" in said


@pytest.mark.parametrize("name", ["../../x", "=1+1", "<b>", "\x1b[2J"])
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
    for words in (["inspect", "run"], ["resume", "run"]):
        assert "run is no folder of a run" in refused(berteam(*words, code=2))


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
    for words in (["resume", "run", "epochs=2"], ["report", "run"]):
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


def test_folders_that_come_and_go_are_no_links(tmp_path):
    """As those of a checkpoint do, beneath whoever reads the folder of a run that goes on."""
    part, ended = tmp_path / "checkpoint" / "part", threading.Event()
    part.parent.mkdir()

    def write():
        while not ended.is_set():
            (part / "deep").mkdir(parents=True)
            part.rename(part.with_name("kept"))
            shutil.rmtree(part.with_name("kept"))

    writer = threading.Thread(target=write)
    writer.start()
    try:
        for _ in range(1000):
            check_links(tmp_path)
    finally:
        ended.set()
        writer.join()
