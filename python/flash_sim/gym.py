"""Tasks as environments of Gymnasium: pip install flash-sim[gym]."""
import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from flash_sim import arguments
from flash_sim.tasks import FoldTask


class FoldVectorEnv(VectorEnv):
    """FoldTask. An episode that ends is followed by the next one's start in the same step (SAME_STEP): infos["final_obs"] has
    the last observations where infos["_final_obs"] is true. With autoreset=False (DISABLED) reset(options={"reset_mask":
    mask}) starts anew. `device` and `threads` are those of the simulation."""

    def __init__(self, num_envs, settings=None, threads=0, autoreset=True, device="auto"):
        self.task = FoldTask(num_envs, settings, threads, device)
        self.num_envs = num_envs
        self.metadata = {"autoreset_mode": AutoresetMode.SAME_STEP if autoreset else AutoresetMode.DISABLED}
        self.single_observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (self.task.observations,), np.float64)
        self.single_action_space = gymnasium.spaces.Box(-1, 1, (self.task.actions,), np.float64)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.autoreset = autoreset

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        mask = (options or {}).get("reset_mask")
        if mask is not None:
            mask = np.flatnonzero(arguments.truths("reset: reset_mask", mask, self.num_envs))
        return self.task.reset(mask, seed=seed), {}

    def step(self, actions):
        observations, rewards, success, time_out = self.task.step(actions)
        infos = {"success": success, "_success": np.ones(self.num_envs, bool)}
        done = success | time_out
        if self.autoreset and done.any():
            infos |= {"final_obs": observations, "_final_obs": done}
            observations = self.task.reset(np.flatnonzero(done))
        return observations, rewards, success, time_out, infos
