"""Tasks for policies: what is seen, what is done, what is asked. No library of reinforcement learning is needed."""
import dataclasses
import pathlib

import numpy as np

from flash_sim.realtime_sim import RealtimeSim

HAND = "hand"
ON_TABLE = 0.001  # height at which the towel starts: half of its thickness [m]


@dataclasses.dataclass
class TowelSettings:
    scene: str = str(pathlib.Path(__file__).parent / "scenes" / "towel.json")  # of one square sheet in the plane z = 0
    randomization: str = "none"   # of materials at each reset, as RealtimeSim.randomize has it
    steps_per_action: int = 4     # of the simulation
    time_limit: int = 200         # actions
    speed: float = 0.4            # of the hand at an action of 1 along each axis [m/s]
    near: float = 0.05            # from the corner across, where a fold is a success [m]
    still: float = 0.1            # of the corner then, at most [m/s]
    shift: float = 0.05           # of the towel at the start, in both directions along x and y [m]
    turn: float = 0.5             # of the towel at the start, both ways [rad]
    seed: int = 0


class TowelTask:
    """A towel with one arm: its corner of the smallest x and largest y (left-top) is to lie on the one across.

    Actions (n, 4): motion of the hand along x, y and z in [-1, 1], times the speed; above 0 it closes, else it opens.
    Observations (n, 14) float64: hand, corner minus hand, goal minus corner [m]; velocity of the corner [m/s]; whether the hand
    is closed, whether it carries anything. A success is a corner that lies within `near` of the goal, let go and at rest.
    """

    actions, observations = 4, 14

    def __init__(self, n_envs, settings=None, threads=0):
        self.settings = settings or TowelSettings()
        self.n_envs = n_envs
        self.sim = RealtimeSim(threads=threads, seed=self.settings.seed)
        self.sim.load_config(self.settings.scene)
        self.sim.set_envs(n_envs)
        self.sim.initialize()
        # A fingertip that is open: what it should take lies below it.
        self.sim.add_ee(HAND, [0, 0, 0.15], size=[0.02, 0.02, 0.02], reach=0.006, collides=False)
        self._x, self._v, self._hand = self.sim.positions(), self.sim.velocities(), self.sim.pose(HAND)
        self._flat = np.array(self._x[0])
        along = self._flat[:, 0] - self._flat[:, 1]
        self._corner, self._goal = int(np.argmin(along)), int(np.argmax(along))
        self._random = np.random.default_rng(self.settings.seed)
        self.lengths = np.zeros(n_envs, int)  # actions of the episodes at hand
        self.closed = np.zeros(n_envs, bool)
        self.reset()

    @property
    def hand(self):
        """(n, 3) [m]"""
        return self._hand[:, :3]

    @property
    def corner(self):
        """Where the corner that is to be carried is, (n, 3) [m]."""
        return self._x[:, self._corner]

    @property
    def goal(self):
        """Where the corner across is, (n, 3) [m]."""
        return self._x[:, self._goal]

    def reset(self, env_ids=None, seed=None):
        """New episodes: the towel lies flat, shifted and turned at random. Returns the observations of all."""
        if seed is not None:
            self._random = np.random.default_rng(seed)
        ids = np.arange(self.n_envs) if env_ids is None else np.asarray(env_ids, int)
        if len(ids):
            self.sim.reset(ids, positions=np.stack([self._placed() for _ in ids]))
            self.sim.randomize(self.settings.randomization, seed=int(self._random.integers(2**31)), env_ids=ids)
            self.lengths[ids] = 0
            self.closed[ids] = False
        return self.observe()

    def observe(self):
        return np.concatenate([self.hand, self.corner - self.hand, self.goal - self.corner, self._v[:, self._corner],
                               self.closed[:, None], self.sim.held(HAND)[:, None] > 0], axis=1)

    def step(self, actions):
        """Returns observations, rewards, success, time_out, of the same episodes: who resets them calls reset.

        Rewards are minus the distance of hand and corner, where it is not carried, minus that of corner and goal [m], and 10
        for a success. An environment that is lost ends as one whose time is up.
        """
        actions = np.clip(np.asarray(actions, np.float64), -1, 1)
        if actions.shape != (self.n_envs, self.actions) or not np.isfinite(actions).all():
            raise ValueError(f"actions: found the shape {actions.shape}, expected finite ({self.n_envs}, {self.actions})")
        self.closed = actions[:, 3] > 0
        self.sim.grasp_ee(HAND, self.closed)
        way = actions[:, :3] * self.settings.speed * self.sim.time_step
        for _ in range(self.settings.steps_per_action):
            place = self.hand + way
            place[:, 2] = np.maximum(place[:, 2], 0.012)  # above the table by half its size and the towel
            self.sim.move_ee(HAND, place)
            self.sim.step()
        self.lengths += 1
        off_goal = np.linalg.norm(self.goal - self.corner, axis=1)
        off_hand = np.linalg.norm(self.corner - self.hand, axis=1) * (self.sim.held(HAND) == 0)
        still = np.linalg.norm(self._v[:, self._corner], axis=1) < self.settings.still
        success = (self.sim.held(HAND) == 0) & still & (off_goal < self.settings.near)
        lost = self.sim.status()["lost"] != 0
        rewards = -np.nan_to_num(off_goal + off_hand, nan=1.0) + 10.0 * success
        return self.observe(), rewards, success & ~lost, lost | (self.lengths >= self.settings.time_limit) & ~success

    def _placed(self):
        turn, shift = self.settings.turn, self.settings.shift
        angle = self._random.uniform(-turn, turn)
        c, s = np.cos(angle), np.sin(angle)
        centre = self._flat.mean(axis=0)
        rotated = (self._flat - centre) @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
        return rotated + centre + [*self._random.uniform(-shift, shift, 2), 0]


APPROACH, GRASP, TRANSPORT = range(3)


class TowelTeacher:
    """The scripted policy: Approach (above the corner), Grasp (down, close), Transport (over in an arc, down, open). What
    drops the corner approaches again."""

    hover = 0.05        # above the corner [m]
    horizontal = 0.01   # from the corner, from where on the hand goes down [m]
    grip = 0.0145       # of the hand above the corner when it closes [m]
    arc = 0.8, 0.15     # height of the way over: times what is left of it, and at most [m]; lower, the fold drags on the rest
    carry = 0.6         # speed with the corner, as a share of the hand's
    put = 0.02          # from the goal, where it opens [m]

    def __init__(self, n_envs):
        self.stage = np.full(n_envs, APPROACH)
        self.put_at = np.zeros((n_envs, 3))  # where the goal was when the corner was taken: it must not be chased [m]

    def reset(self, env_ids):
        self.stage[env_ids] = APPROACH

    def act(self, task):
        hand, corner, goal = task.hand, task.corner, task.goal
        carries = task.sim.held(HAND) > 0
        self.stage[(self.stage == TRANSPORT) & ~carries] = APPROACH
        above = np.linalg.norm((corner - hand)[:, :2], axis=1) < self.horizontal
        self.stage[(self.stage == APPROACH) & above] = GRASP
        self.stage[(self.stage == GRASP) & ~above & ~carries] = APPROACH
        taken = (self.stage == GRASP) & carries
        self.put_at[taken] = goal[taken]
        self.stage[taken] = TRANSPORT

        approach, grasp, transport = (self.stage == s for s in (APPROACH, GRASP, TRANSPORT))
        left = np.linalg.norm((self.put_at - corner)[:, :2], axis=1)
        at = np.where(grasp[:, None], corner + [0, 0, self.grip], corner + [0, 0, self.hover])
        arc = self.put_at + (hand - corner) * [1, 1, 0]  # the hand keeps its place over the corner
        arc[:, 2] += self.grip + 0.004 + np.minimum(self.arc[0] * left, self.arc[1])
        at = np.where(transport[:, None], arc, at)
        low = hand[:, 2] - corner[:, 2] < self.grip + 0.003
        close = grasp & low | transport & ~((left < self.put) & (hand[:, 2] < 0.04))
        step = task.settings.speed * task.settings.steps_per_action * task.sim.time_step
        way = (at - hand) / step
        way[:, :2] /= np.maximum(1, np.abs(way[:, :2]).max(axis=1, keepdims=True))
        way[:, 2] = np.clip(way[:, 2], -1, 1)
        way[transport] *= self.carry
        # Up before over: the corner is not dragged along the table.
        way[:, :2] *= np.where(transport & (arc[:, 2] - hand[:, 2] > 0.02), 0.3, 1)[:, None]
        return np.concatenate([way, np.where(close, 1.0, -1.0)[:, None]], axis=1)
