"""The game as a PettingZoo environment in which agents act in turn; all move when the last one has chosen.

``env.unwrapped`` is the parallel environment: its ``save`` returns the game as it is between two moves, and the option
``state`` of ``reset`` takes it up.
"""

from typing import Any

from pettingzoo.utils.conversions import parallel_to_aec_wrapper
from pettingzoo.utils.wrappers import OrderEnforcingWrapper

from mctf.parallel import MctfEnv


def raw_env(reward: Any = "custom_rew2", **given: Any) -> "TurnsEnv":
    """Returns one game without a check of the order of calls; arguments as of ``MctfEnv``."""
    return TurnsEnv(MctfEnv(reward, **given))


def env(reward: Any = "custom_rew2", **given: Any) -> "OrderedEnv":
    """Returns one game; arguments as of ``MctfEnv``."""
    return OrderedEnv(raw_env(reward, **given))


class TurnsEnv(parallel_to_aec_wrapper[str, Any, Any]):
    """PettingZoo's conversion, but an action is refused when it is given, not in the turn of the last agent."""

    env: MctfEnv

    def step(self, action: Any) -> None:
        """Takes the action of ``agent_selection``; None of one whose game is over.

        Raises:
            ValueError: the action is not allowed; it is the same agent's turn still.
        """
        agent = self.agent_selection
        if not (self.terminations[agent] or self.truncations[agent]):
            self.env.check_action(agent, action)
        elif action is not None:
            raise ValueError(f"the action of {agent} must be None, as its game is over, but is {action!r}.")
        super().step(action)


class OrderedEnv(OrderEnforcingWrapper[str, Any, Any]):
    """PettingZoo's check of the order of calls, but a step without a game is an error also after its end."""

    def step(self, action: Any) -> None:
        """Takes the action of ``agent_selection``.

        Raises:
            RuntimeError: there is no game, or it is over.
            ValueError: the action is not allowed.
        """
        if not (self._has_reset and self.agents):
            raise RuntimeError("step must come after reset and before the end of the game, but there is no game now.")
        super().step(action)

    def __str__(self) -> str:
        return str(self.env)
