"""Tasks as environments of rsl_rl: pip install flash-sim[rsl]."""
import dataclasses

import numpy as np
import torch
from rsl_rl.env import VecEnv
from tensordict import TensorDict

from flash_sim.tasks import FoldTask


class FoldVecEnv(VecEnv):
    """FoldTask, with its observations in the group "policy". An episode that ends is followed by the next one's start in the
    same step; extras["time_outs"] says which ended for want of time. `device` is that of the tensors, `sim_device` and `threads`
    are those of the simulation; between them observations and actions go through the memory of the processor."""

    def __init__(self, num_envs, settings=None, threads=0, device="cpu", sim_device="auto"):
        self.task = FoldTask(num_envs, settings, threads, sim_device)
        self.num_envs, self.num_actions, self.device = num_envs, self.task.actions, device
        self.max_episode_length = self.task.time_limit
        self.cfg = dataclasses.asdict(self.task.settings)

    @property
    def episode_length_buf(self):
        return self._tensor(self.task.lengths, torch.long)

    @episode_length_buf.setter
    def episode_length_buf(self, lengths):
        """The runner lets the first episodes end at different times."""
        self.task.lengths[:] = lengths.cpu().numpy()

    def get_observations(self):
        return self._group(self.task.observe())

    def step(self, actions):
        observations, rewards, success, time_out = self.task.step(actions.detach().cpu().numpy())
        done = success | time_out
        if done.any():
            observations = self.task.reset(np.flatnonzero(done))
        extras = {"time_outs": self._tensor(time_out, torch.bool),
                  "log": {"/success": float(success.sum() / max(1, done.sum()))}}
        return self._group(observations), self._tensor(rewards), self._tensor(done, torch.long), extras

    def _group(self, observations):
        return TensorDict({"policy": self._tensor(observations)}, batch_size=[self.num_envs], device=self.device)

    def _tensor(self, array, dtype=torch.float32):
        return torch.as_tensor(array, dtype=dtype, device=self.device)
