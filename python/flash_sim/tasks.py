"""Tasks for policies: what is seen, what is done, what is asked. No library of reinforcement learning is needed."""
import dataclasses

import numpy as np

from flash_sim import arguments
from flash_sim.device_array import to_host
from flash_sim.folds import FOLDS, Fold, Lift
from flash_sim.realtime_sim import RealtimeSim

HOME = 0.15   # height of a hand at the start [m]
TOUCH = 0.014  # of a hand above the table, at least: it reaches the cloth, and hardly presses what it holds into the table [m]


@dataclasses.dataclass
class FoldSettings:
    fold: str | Fold = "towel"    # one of FOLDS, or one's own
    randomization: str = "none"   # of materials at each reset, as RealtimeSim.randomize has it
    steps_per_action: int = 4     # of the simulation
    time_limit: int = 200         # actions per stage
    speed: float = 0.4            # of a hand at an action of 1 along each axis [m/s]
    near: float = 0.05            # from where it is to be, where what was carried is there [m]
    still: float = 0.1            # of it then, at most [m/s]
    shift: float = 0.05           # of the cloth at the start, in both directions along x and y [m]
    turn: float = 0.5             # of the cloth at the start, both ways [rad]
    seed: int = 0

    def __post_init__(self):
        for name, least in (("steps_per_action", 1), ("time_limit", 1), ("seed", 0)):
            arguments.whole_number(f"FoldSettings: {name}", getattr(self, name), least)
        for name, most in (("speed", 100), ("near", 100), ("still", 100), ("shift", 100), ("turn", np.pi)):
            value = float(arguments.numbers(f"FoldSettings: {name}", getattr(self, name), ()))
            if not (0 <= value <= most and (value > 0 or name in ("shift", "turn"))):
                raise ValueError(f"FoldSettings: {name}: found {value:.6g}, expected "
                                 f"{'0' if name in ('shift', 'turn') else 'above 0'} to {most:.4g}")


class FoldTask:
    """A cloth is folded or lifted by stages: each hand of a stage is to lay one place of the cloth on another one and to let go
    (Carry), or to lift it and to hold it (Lift).

    Actions (n, 4 per hand): motion along x, y and z in [-1, 1], times the speed; above 0 a hand closes, else it opens.
    Observations (n, 14 per hand, and 1 per stage where there are several) float64, of each hand: its place, where it is to take
    minus its place, where it is to lay or to hold minus where it is to take [m]; velocity of what it is to take [m/s]; whether it
    is closed, whether it carries anything. A hand that a stage does not need sees zeros there. Then which stage it is. A stage is
    done when all it carries is within `near` of where it is to be, at rest, held where it is lifted and else let go. The last one
    is the success.

    All of these are arrays of numpy. `device` and `threads` are those of RealtimeSim. From a CUDA device the positions and
    velocities of all vertices are copied once an action, and at a reset.
    """

    def __init__(self, n_envs, settings=None, threads=0, device="auto"):
        self.settings = FoldSettings() if settings is None else settings
        if not isinstance(self.settings, FoldSettings):
            raise TypeError(f"FoldTask: settings: found {settings!r:.60}, expected FoldSettings")
        self.n_envs = n_envs
        self.fold = _fold(self.settings.fold)
        self.sim = RealtimeSim(device, self.settings.seed, threads)
        self.sim.load_config(self.fold.scene)
        self.sim.set_envs(n_envs)
        self.sim.initialize()
        if len(self.sim.bodies) != 1:
            raise ValueError(f"fold: {self.fold.scene}: found {len(self.sim.bodies)} objects, expected one sheet")
        self.hands, self.stages = self.fold.hands, len(self.fold.stages)
        self._look()
        self._flat = np.array(self._x[0])
        # By stage and hand, -1 where a hand has nothing to do.
        self._take = np.full((self.stages, len(self.hands)), -1)
        self._lay = np.full_like(self._take, -1)
        self._height = np.zeros(self._take.shape)  # of what is lifted, else 0 [m]
        for s, stage in enumerate(self.fold.stages):
            for carry in stage:
                h = self.hands.index(carry.hand)
                self._take[s, h] = self._vertex(carry.take)
                if isinstance(carry, Lift):
                    self._height[s, h] = carry.height
                else:
                    self._lay[s, h] = self._vertex(carry.lay)
        for hand, home in zip(self.hands, self._homes()):
            # A fingertip that is open: what it should take lies below it.
            self.sim.add_ee(hand, home, size=[0.02, 0.02, 0.02], reach=0.006, collides=False)
        self._poses = [self.sim.pose(hand) for hand in self.hands]
        self.actions = 4 * len(self.hands)
        self.observations = 14 * len(self.hands) + (self.stages if self.stages > 1 else 0)
        self.time_limit = self.settings.time_limit * self.stages  # actions
        self._random = np.random.default_rng(self.settings.seed)
        self.lengths = np.zeros(n_envs, int)  # actions of the episodes at hand
        self.stage = np.zeros(n_envs, int)
        self.closed = np.zeros((n_envs, len(self.hands)), bool)
        self._began = np.zeros((n_envs, len(self.hands), 3))  # where what is to be carried was when the stage began [m]
        self.reset()

    # Arrays by hand, (n, hands, ...).

    @property
    def place(self):
        """Of the hands [m]."""
        return np.stack([pose[:, :3] for pose in self._poses], axis=1)

    @property
    def works(self):
        """Whether a hand has something to carry in the stage at hand."""
        return self._take[self.stage] >= 0

    @property
    def holds(self):
        """Whether a hand is to hold what it carries in the stage at hand, not to let it go."""
        return self._height[self.stage] > 0

    @property
    def take(self):
        """Where the cloth that is to be carried is [m]."""
        return self._at(self._x, self._take)

    @property
    def lay(self):
        """Where it is to be: where the cloth on which it is to lie is, or above where it lay [m]."""
        above = self._began + self._height[self.stage][:, :, None] * [0, 0, 1]
        return np.where(self.holds[:, :, None], above, self._at(self._x, self._lay))

    @property
    def carries(self):
        return np.stack([self.sim.held(hand) > 0 for hand in self.hands], axis=1)

    def reset(self, env_ids=None, seed=None):
        """New episodes: the cloth lies flat, shifted and turned at random. Returns the observations of all."""
        if seed is not None:
            self._random = np.random.default_rng(arguments.whole_number("reset: seed", seed, 0, 2**63 - 1))
        ids = arguments.environments("reset: env_ids", env_ids, self.n_envs)
        if len(ids):
            self.sim.reset(ids, positions=np.stack([self._placed() for _ in ids]))
            self.sim.randomize(self.settings.randomization, seed=int(self._random.integers(2**31)), env_ids=ids)
            self.lengths[ids] = self.stage[ids] = 0
            self.closed[ids] = False
            self._look()
            self._began[ids] = self.take[ids]
        return self.observe()

    def observe(self):
        take, works = self.take, self.works[:, :, None]
        of_hands = np.concatenate([
            self.place, (take - self.place) * works, (self.lay - take) * works, self._at(self._v, self._take) * works,
            self.closed[:, :, None], self.carries[:, :, None]], axis=2).reshape(self.n_envs, -1)
        return of_hands if self.stages == 1 else np.concatenate([of_hands, np.eye(self.stages)[self.stage]], axis=1)

    def step(self, actions):
        """Returns observations, rewards, success, time_out, of the same episodes: who resets them calls reset.

        Rewards are minus the distances of what is to be carried from where it is to be [m]. Of hands that work, a fifth of their
        distance from what they are to take is added, and of 0.05 m more where they carry nothing. Motion costs 0.006 times the
        sum of its squares. A stage that is done gives 2. An environment that is lost ends as one whose time is up.
        """
        actions = np.clip(arguments.numbers("step: actions", actions, (self.n_envs, self.actions)), -1, 1)
        by_hand = actions.reshape(self.n_envs, -1, 4)
        self.closed = by_hand[:, :, 3] > 0
        way = by_hand[:, :, :3] * self.settings.speed * self.sim.time_step
        for h, hand in enumerate(self.hands):
            self.sim.grasp_ee(hand, self.closed[:, h])
        for _ in range(self.settings.steps_per_action):
            for h, hand in enumerate(self.hands):
                place = self._poses[h][:, :3] + way[:, h]
                place[:, 2] = np.maximum(place[:, 2], TOUCH)
                self.sim.move_ee(hand, place)
            self.sim.step()
        self._look()
        self.lengths += 1
        return self._judged((by_hand[:, :, :3] ** 2).sum(axis=(1, 2)))

    def _judged(self, motion):
        works, carries, take = self.works, self.carries, self.take
        off_goal = np.linalg.norm(self.lay - take, axis=2) * works
        off_hand = (np.linalg.norm(take - self.place, axis=2) + 0.05 * ~carries) * works
        still = np.linalg.norm(self._at(self._v, self._take), axis=2) * works < self.settings.still
        lost = to_host(self.sim.status()["lost"]) != 0
        done = (still & (off_goal < self.settings.near) & (carries == self.holds)).all(axis=1) & ~lost
        rewards = -np.nan_to_num((off_goal + 0.2 * off_hand).sum(axis=1), nan=1.0) - 0.006 * motion + 2.0 * done
        success = done & (self.stage == self.stages - 1)
        next_stage = done & ~success
        self.stage[next_stage] += 1
        self._began[next_stage] = self.take[next_stage]
        time_out = lost | (self.lengths >= self.time_limit) & ~success
        return self.observe(), rewards, success, time_out

    def _look(self):
        """At the cloth: the views of the processor, or copies from a device."""
        views = self.sim.positions(), self.sim.velocities()
        self._x, self._v = views if self.sim.device == "cpu" else map(to_host, views)

    def _at(self, of_vertices, table):
        """Rows of the vertices that a table has for the stage of each environment, (n, hands, 3)."""
        return of_vertices[np.arange(self.n_envs)[:, None], table[self.stage]]

    def _vertex(self, share):
        low, high = self._flat.min(axis=0), self._flat.max(axis=0)
        off = np.linalg.norm((self._flat - low - np.asarray([*share, 0]) * (high - low))[:, :2], axis=1)
        nearest = np.flatnonzero(off < off.min() + 1e-6)
        return int(nearest[np.argmax(self._flat[nearest, 2])])

    def _homes(self):
        """Of each hand: above the middle of the cloth, side by side [m]."""
        middle = 0.5 * (self._flat.min(axis=0) + self._flat.max(axis=0))
        aside = 0.1 * (np.arange(len(self.hands)) - 0.5 * (len(self.hands) - 1))
        return [[middle[0] + x, middle[1], HOME] for x in aside]

    def _placed(self):
        turn, shift = self.settings.turn, self.settings.shift
        angle = self._random.uniform(-turn, turn)
        c, s = np.cos(angle), np.sin(angle)
        centre = self._flat.mean(axis=0)
        rotated = (self._flat - centre) @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
        return rotated + centre + [*self._random.uniform(-shift, shift, 2), 0]


def _fold(fold):
    if isinstance(fold, Fold):
        return fold
    if not isinstance(fold, str) or fold not in FOLDS:
        raise ValueError(f"fold: found {fold!r}, expected one of {', '.join(FOLDS)}, or a Fold")
    return FOLDS[fold]


APPROACH, GRASP, TRANSPORT = range(3)


class FoldTeacher:
    """The scripted policy of the stages: Approach (above what is to be taken), Grasp (down, close; wait for the other hands),
    Transport (over in an arc, down, open; or up, to hold it). Hands that drop something approach again, and so do those beside them."""

    hover = 0.05        # above what is to be taken [m]
    horizontal = 0.01   # from it, from where on a hand goes down [m]
    grip = 0.0145       # of a hand above it when it closes [m]
    arc = 0.8, 0.15     # height of the way over: times what is left of it, and at most [m]; lower, the fold drags on the rest
    carry = 0.6         # speed with it, as a share of the hand's
    put = 0.02          # from where it is to lie, where a hand opens [m]

    def __init__(self, task):
        if not isinstance(task, FoldTask):
            raise TypeError(f"FoldTeacher: task: found {task!r:.60}, expected a FoldTask")
        shape = task.n_envs, len(task.hands)
        self.state = np.full(shape, APPROACH)
        self.stage = np.array(task.stage)
        self.put_at = np.zeros((*shape, 3))  # where that was when the cloth was taken: it must not be chased [m]

    def reset(self, env_ids):
        self.state[env_ids] = APPROACH

    def act(self, task):
        place, take, lay, carries, works, holds = task.place, task.take, task.lay, task.carries, task.works, task.holds
        new = task.stage != self.stage
        self.stage[:] = task.stage
        dropped = ((self.state == TRANSPORT) & works & ~carries).any(axis=1)
        self.state[new | dropped] = APPROACH
        above = np.linalg.norm((take - place)[:, :, :2], axis=2) < self.horizontal
        self.state[(self.state == APPROACH) & above] = GRASP
        self.state[(self.state == GRASP) & ~above & ~carries] = APPROACH
        taken = ((self.state == GRASP) & carries | ~works).all(axis=1)
        self.put_at[taken] = lay[taken]
        self.state[taken] = TRANSPORT

        approach, grasp, transport = (self.state == s for s in (APPROACH, GRASP, TRANSPORT))
        left = np.linalg.norm((self.put_at - take)[:, :, :2], axis=2)
        at = take + [0, 0, self.hover]
        at[grasp] = take[grasp] + [0, 0, self.grip]
        arc = self.put_at + (place - take) * [1, 1, 0]  # a hand keeps its place over what it carries
        arc[:, :, 2] += self.grip + 0.004 + np.minimum(self.arc[0] * left, self.arc[1])
        at[transport] = arc[transport]
        at[~works] = place[~works] * [1, 1, 0] + [0, 0, HOME]
        low = place[:, :, 2] - take[:, :, 2] < self.grip + 0.003
        # All hands that let go do so together.
        there = ((left < self.put) & (place[:, :, 2] < 0.04) | ~works).all(axis=1)[:, None]
        close = works & (grasp & (low | carries) | transport & (holds | ~there))
        way = (at - place) / (task.settings.speed * task.settings.steps_per_action * task.sim.time_step)
        way[:, :, :2] /= np.maximum(1, np.abs(way[:, :, :2]).max(axis=2, keepdims=True))
        way[:, :, 2] = np.clip(way[:, :, 2], -1, 1)
        way[transport] *= self.carry
        # Up before over: what is carried is not dragged along the table.
        way[:, :, :2] *= np.where(transport & (arc[:, :, 2] - place[:, :, 2] > 0.02), 0.3, 1)[:, :, None]
        # A hand that carries waits for the others.
        way[grasp & carries] = 0
        return np.concatenate([way, np.where(close, 1.0, -1.0)[:, :, None]], axis=2).reshape(task.n_envs, -1)
