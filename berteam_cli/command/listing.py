"""berteam list: what can be chosen, each with its first line of explanation."""

from __future__ import annotations

import importlib.resources

from hydra import initialize_config_module
from rich.console import Console

from berteam_cli.compose import CONF, choices, groups, prepare
from berteam_cli.errors import InputError


def show(group: str | None) -> None:
    """Prints the choices of ``group``, or of all groups.

    Raises:
        InputError: there is no such group.
    """
    prepare()
    console = Console(soft_wrap=True, highlight=False)
    with initialize_config_module(CONF, version_base="1.3"):
        if group is not None and group not in groups():
            raise InputError.choice("group", group, groups())
        for name in [group] if group else groups():
            console.print(f"[bold]{name}[/bold]")
            for option in choices(name):
                console.print(f"  {name}={option:<18} {about(name, option)}", markup=False)


def about(group: str, option: str) -> str:
    """Returns the first comment of the choice's yaml file."""
    text = importlib.resources.files(CONF).joinpath(group, f"{option}.yaml").read_text(encoding="utf-8")
    comments = [line[1:].strip() for line in text.splitlines() if line.startswith("#")]
    return next((line for line in comments if not line.startswith("@package")), "")
