"""What a report is made from: the tables of a run, those of its evaluation, its manifest and its config."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import pandas as pd
from omegaconf import OmegaConf

from berteam_cli.command.inspect import read_table
from berteam_cli.errors import InputError
from berteam_cli.folder import CONFIG, evaluated_at, newest, read_manifest
from berteam_cli.records import COLUMNS, EVALUATION

STATUS = {
    "running": "This run had not ended when the report was made, or it was killed: what follows is as far as it got.",
    "interrupted": "This run was interrupted: what follows is as far as it got. `berteam resume` goes on with it.",
    "failed": "This run failed: what follows is as far as it got. error.txt in its folder says why.",
}
FREE = {"members": ("agent", "aggression"), "regression": ("quantity", "value"), "figures": ("quantity", "value")}
"""Tables of an evaluation that may have more columns than a report needs, and those it needs."""


@dataclass(frozen=True)
class Source:
    """A run's folder, read where a plot asks for it.

    Attributes:
        folder: of the run.
        manifest: as it stands there.
        trust: what the run's game may import.
    """

    folder: Path
    manifest: dict[str, Any]
    trust: tuple[str, ...] = ()

    @classmethod
    def of(cls, folder: Path, trust: tuple[str, ...] = ()) -> Source:
        """Returns the run in ``folder``, whose game may import what ``trust`` names.

        Raises:
            InputError: there is none.
        """
        return cls(folder, read_manifest(folder), trust)

    @property
    def whole(self) -> bool:
        """Whether the run has ended, so that its tables must be whole."""
        return bool(self.manifest["status"] == "done")

    @property
    def remark(self) -> str | None:
        """What must be said of the run before anything else."""
        said = [STATUS[self.manifest["status"]]] if self.manifest["status"] in STATUS else []
        if self.outdated:
            said.append(
                f"`berteam evaluate` looked at this run after epoch {evaluated_at(self.folder)}; it has gone on since, "
                "so what was found is left out. Evaluate it anew."
            )
        return " ".join(said) or None

    @cached_property
    def outdated(self) -> bool:
        """Whether the run has gone on since it was evaluated, as far as its checkpoints tell."""
        seen, now = evaluated_at(self.folder), newest(self.folder)
        return seen != now and -1 not in {seen, now}

    def table(self, name: str) -> pd.DataFrame | None:
        """Returns a table of the run, None where there is none or it is empty.

        Raises:
            InputError: it is cut off or not such a table.
        """
        return filled(read_table(self.folder, name, whole=self.whole))

    def evaluated(self, name: str) -> pd.DataFrame | None:
        """Returns a table of the run's evaluation, None where there is none, or it is empty or of an earlier epoch.

        Raises:
            InputError: it is cut off or not such a table.
        """
        if self.outdated:
            return None
        columns = FREE[name] if name in FREE else COLUMNS[name]
        return filled(read_table(self.folder / EVALUATION, name, columns=columns))

    @cached_property
    def elo(self) -> pd.DataFrame | None:
        """The rated teams, the strongest first: all of them where the run was evaluated."""
        table = self.evaluated("elo")
        table = self.table("elo") if table is None else table
        return None if table is None else table.sort_values("rank", kind="stable", ignore_index=True)

    @cached_property
    def agents(self) -> pd.DataFrame | None:
        """The members at every record."""
        return self.table("agents")

    @cached_property
    def called(self) -> dict[int, str]:
        """Names of the members after the last record."""
        if self.agents is None:
            return {}
        last = self.agents[self.agents.epoch == self.agents.epoch.max()]
        return dict(zip(last.agent, last["name"].astype(str), strict=True))

    @cached_property
    def exploiters(self) -> list[str]:
        """Islands whose members are never chosen for teams, and so never rated; none where no config tells."""
        from berteam_cli.stored import plain_config  # noqa: PLC0415 (it brings torch, which tables do not need)

        with suppress(InputError):
            return list(OmegaConf.select(plain_config(self.folder), "opponents.exploiters") or [])
        return []

    @cached_property
    def config(self) -> str | None:
        """The config as text, None where there is none."""
        path = self.folder / CONFIG
        return path.read_text(encoding="utf-8", errors="replace") if path.exists() else None


def filled(table: pd.DataFrame | None) -> pd.DataFrame | None:
    """Returns ``table``, or None where it has no rows."""
    return None if table is None or table.empty else table
