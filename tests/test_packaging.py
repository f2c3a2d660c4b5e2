"""The package as a user gets it: a wheel, installed in an empty folder, with the checkout out of reach."""

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    source = folder / "source"
    ignored = {".git", ".venv", "outputs", "build", "dist", "tests"}
    subprocess.run(["mkdir", source], check=True)
    for path in ROOT.iterdir():
        if path.name not in ignored and not path.name.endswith(".egg-info"):
            subprocess.run(["cp", "-r", path, source], check=True)
    build = [sys.executable, "-m", "pip", "wheel", "--no-deps", "--no-build-isolation", "--quiet", "-w", folder, source]
    subprocess.run(build, check=True)
    return next(folder.glob("*.whl"))


def test_the_wheel_holds_what_it_should(wheel):
    names = set(zipfile.ZipFile(wheel).namelist())
    code = ("berteam_cli/**/*.py", "hydra_plugins/**/*.py")
    kept = ("conf/**/*.yaml", *code, "berteam_cli/**/*.csv", "berteam_cli/**/page.*")
    sources = (path for pattern in kept for path in ROOT.glob(pattern) if path.parent.name != "__pycache__")
    for path in sources:
        inside = path.relative_to(ROOT).as_posix()
        inside = inside if inside.startswith(("berteam_cli", "hydra_plugins")) else f"berteam_cli/{inside}"
        assert inside in names
    for path in (*ROOT.glob("envs/*/*.py"), *ROOT.glob("envs/mctf/page.*")):
        assert path.relative_to(ROOT / "envs").as_posix() in names
    tops = {name.split("/")[0] for name in names if not name.split("/")[0].endswith(".dist-info")}
    assert tops == {"berteam_cli", "hydra_plugins", "mctf", "rps"}


def test_the_installed_wheel_trains(wheel, tmp_path):
    site, work = tmp_path / "site", tmp_path / "work"
    work.mkdir()
    install = [sys.executable, "-m", "pip", "install", "--no-deps", "--quiet", "--target", site, wheel]
    subprocess.run(install, check=True)
    program = "import berteam_cli; print(berteam_cli.__file__); from berteam_cli.cli import main; main()"
    words = ["train", "env=rps", "population=ppo6", "selector=mcaa", "epochs=2", "out=run"]
    command = [sys.executable, "-c", program, *words]
    environment = {**os.environ, "PYTHONPATH": str(site)}
    done = subprocess.run(command, cwd=work, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith(str(site))
    assert (work / "run" / "elo.csv").exists()
