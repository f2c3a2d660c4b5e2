"""Members that act by networks from files of Stable-Baselines3 and learn nothing."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

import numpy as np
import torch
from numpy.random import Generator

from berteam_cli.acting import Policies
from berteam_cli.learner.base import Learning
from berteam_cli.learner.zipped import Unfit, Untold, network
from berteam_cli.outcomes import Experience, Ints
from berteam_cli.workers import Workers


class ImportedState(NamedTuple):
    """How an island of imported members acts.

    Attributes:
        files: (M,) whose file each member is, a copy that of its parent.
        policies: a row for each member, whose networks may be of different sizes.
    """

    files: Ints
    policies: Policies


@dataclass(frozen=True, eq=False)
class Imported:
    """Settings of an island of imported members.

    Attributes:
        called: (M,) the name of each file's member.
        observation_size: O, of the game.
        actions: A.
        networks: (M,) what the files hold; None for a run that has a checkpoint, which holds it, too.
    """

    called: tuple[str, ...]
    observation_size: int
    actions: int
    networks: Policies | None

    algorithm: ClassVar[str] = "imported"
    buffer: ClassVar[str] = ""

    def init(self, members: int, rng: Generator) -> ImportedState:
        """Returns the networks of the files; draws nothing."""
        if self.networks is None:
            raise RuntimeError("The files were not read, as a checkpoint was to be.")
        if members != len(self.called):
            raise ValueError(f"members must be {len(self.called)}, one for each file, but is {members}.")
        return ImportedState(np.arange(members), Policies._make(column.copy() for column in self.networks))

    def policies(self, state: ImportedState, *, explore: bool) -> Policies:
        """Returns the networks, which act the same whether they ``explore`` or not."""
        return Policies._make(column.copy() for column in state.policies)

    def state_bytes(self, members: int) -> int:
        """Returns the bytes of the networks that were read."""
        return 8 * members + sum(column.nbytes for column in self.networks or ())

    def names(self, state: ImportedState, island: str) -> list[str]:
        """Returns the names of the files' members."""
        return [self.called[file] for file in state.files]

    def learn(
        self, state: ImportedState, experience: Experience, first: int, rng: Generator, workers: Workers
    ) -> list[Learning]:
        """Returns how many steps each member made."""
        played = experience.trajectories(first, len(state.files))
        return [
            Learning(row, steps=sum(int(experience.lengths[game]) for game, _ in games))
            for row, games in played.items()
        ]

    def copy(self, state: ImportedState, child: int, parent: int) -> None:
        """Makes ``child`` act as ``parent`` does, whatever the sizes of their networks."""
        for column in (state.files, *state.policies):
            column[child] = column[parent]

    def tensors(self, state: ImportedState) -> dict[str, Any]:
        """Returns the networks, and whose they are."""
        columns = {"files": state.files, **state.policies._asdict()}
        return {name: torch.from_numpy(column) for name, column in columns.items()}

    def restored(self, tensors: dict[str, Any]) -> ImportedState:
        """Returns the state that ``tensors`` gave these; the files may have gone or changed since.

        Raises:
            ValueError: they are of other members, or of another game.
        """
        columns = {name: tensor.numpy().copy() for name, tensor in tensors.items()}
        state = ImportedState(columns.pop("files"), Policies(**columns))
        sizes = state.policies.sizes
        last = sizes[np.arange(len(sizes)), (sizes > 0).sum(axis=1) - 1]
        if (
            len(sizes) != len(self.called)
            or (sizes[:, 0] != self.observation_size).any()
            or (last != self.actions).any()
        ):
            raise ValueError("its imported members are not as many, or of another game")
        return state


def read(path: Path, observation_size: int, actions: int, *, trust: bool) -> Policies:
    """Returns one row: how the policy in the file ``path`` acts.

    Args:
        path: of the file.
        observation_size: O, of the game.
        actions: A.
        trust: whether code in the file may run. What its plain part does not tell is then asked of the policy that
            Stable-Baselines3 loads.

    Raises:
        Unfit: it holds no policy that can act here; the message goes on from the file's name.
    """
    try:
        return network(path, observation_size, actions)
    except Untold as error:
        if not trust:
            raise Unfit(
                f"{error}; if you trust it, say trust: true, and Stable-Baselines3 loads it, which may run code in it"
            ) from error
    from berteam_cli.learner.trusted import trusted_network  # noqa: PLC0415 (it brings Stable-Baselines3)

    return trusted_network(path, observation_size, actions)
