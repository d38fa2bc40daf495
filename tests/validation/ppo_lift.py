#!/usr/bin/env python3
"""PPO of rsl_rl learns to lift a towel's corner from state: python ppo_lift.py --out FOLDER [--envs N]

Prints and writes the learning curve (.csv, .svg), then tries the policy, without its noise, on 100 fresh starts."""
import argparse
import pathlib
import time

import numpy
import torch
from matplotlib import pyplot
from rsl_rl.runners import OnPolicyRunner

from flash_sim.rsl import FoldVecEnv
from flash_sim.tasks import FoldSettings

TRIALS, ACTIONS = 100, 100  # actions of an episode at most; the scripted policy needs some 40
MODEL = {"class_name": "MLPModel", "hidden_dims": [128, 128], "activation": "elu", "obs_normalization": True}
TRAINING = {
    "num_steps_per_env": 16, "save_interval": 1000, "obs_groups": {"actor": ["policy"], "critic": ["policy"]},
    # Within the range of actions: the mean of a Gaussian leaves it, and the way up is no longer tried.
    "actor": MODEL | {"distribution_cfg": {"class_name": "BetaDistribution"}}, "critic": MODEL,
    "algorithm": {"class_name": "PPO", "gamma": 0.95, "entropy_coef": 0.05, "learning_rate": 1e-3, "schedule": "fixed"},
}


class Watched(FoldVecEnv):
    """Keeps of each action the mean reward, and how many episodes ended and succeeded."""
    seen = []

    def step(self, actions):
        observations, rewards, dones, extras = super().step(actions)
        self.seen.append((rewards.mean().item(), dones.sum().item(), (dones.bool() & ~extras["time_outs"]).sum().item()))
        return observations, rewards, dones, extras


def made(kind, count, seed, options):
    settings = FoldSettings("lift", randomization="published", time_limit=ACTIONS, seed=seed)
    return kind(count, settings, options.threads, options.device, options.sim_device)


def train(options):
    """The runner, and of each iteration its number, seconds since the start, mean reward of an action, share of successes."""
    env = made(Watched, options.envs, options.seed, options)
    runner = OnPolicyRunner(env, TRAINING, log_dir=None, device=options.device)
    curve, begin = [], time.monotonic()
    for iteration in range(options.iterations):
        runner.learn(1, init_at_random_ep_len=iteration == 0)
        rewards, ended, succeeded = zip(*env.seen)
        env.seen.clear()
        curve.append((iteration + 1, time.monotonic() - begin, sum(rewards) / len(rewards), sum(succeeded) / max(1, sum(ended))))
        print("iteration {:4d}  {:6.1f} s  reward {:7.3f}  success {:5.2f}".format(*curve[-1]), flush=True)
    return runner, curve


def trials(runner, options):
    """How many fresh starts end in success, by the mean of the policy."""
    env = made(FoldVecEnv, TRIALS, options.seed + 10000, options)
    policy, observations, success = runner.get_inference_policy(options.device), env.get_observations(), 0
    running = torch.ones(TRIALS, dtype=torch.bool, device=options.device)
    with torch.inference_mode():
        for _ in range(ACTIONS):
            observations, _, dones, extras = env.step(policy(observations))
            success += (running & dones.bool() & ~extras["time_outs"]).sum().item()
            running &= ~dones.bool()
    return success


def draw(curve, title, path):
    _, seconds, rewards, successes = zip(*curve)
    pyplot.rcParams |= {"svg.fonttype": "none", "svg.hashsalt": "ppo_lift"}
    figure, both = pyplot.subplots(2, sharex=True, figsize=(7.6, 4.7))
    for axes, values, label in zip(both, (rewards, successes), ("mean reward of an action", "success of episodes")):
        axes.plot(seconds, values)
        axes.set_ylabel(label)
    both[0].set_title(title)
    both[1].set_xlabel("training [s]")
    figure.savefig(path, metadata={"Date": None})


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    for name, value in (("envs", 64), ("iterations", 100), ("seed", 1), ("threads", 1)):
        parser.add_argument(f"--{name}", type=int, default=value)
    parser.add_argument("--sim-device", default="cpu")
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--out", type=pathlib.Path, required=True)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    torch.manual_seed(options.seed)
    torch.set_num_threads(options.threads)
    runner, curve = train(options)
    numpy.savetxt(options.out / "ppo_lift.csv", curve, "%g", ",", header="iteration,seconds,reward,success", comments="")
    draw(curve, f"PPO lifts a corner: {options.envs} environments on {runner.env.task.sim.device}", options.out / "ppo_lift.svg")
    print(f"success of {TRIALS} fresh starts: {trials(runner, options)}")


if __name__ == "__main__":
    main()
