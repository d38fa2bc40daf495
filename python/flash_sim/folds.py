"""What is folded or lifted: scenes, hands, and who carries what where. A stage table as the scripted policy and the reward read it."""
import dataclasses
import pathlib

from flash_sim import arguments

SCENES = pathlib.Path(__file__).parent / "scenes"


@dataclasses.dataclass(frozen=True)
class Carry:
    """A hand takes the cloth at one place and lays it on another. Both are places on the cloth as it lies flat, as shares of its
    extent: (0, 0) is the least x and y, (1, 1) the most; the vertex nearest to it, of several layers the upper one."""
    hand: str
    take: tuple[float, float]
    lay: tuple[float, float]

    def __post_init__(self):
        _check(self, "take", "lay")
        if tuple(self.take) == tuple(self.lay):
            raise ValueError(f"Carry: lay: found {tuple(self.lay)}, where it is taken, expected another place")


@dataclasses.dataclass(frozen=True)
class Lift:
    """A hand takes the cloth at one place, as of Carry, lifts it above where it lay when the stage began, and holds it there."""
    hand: str
    take: tuple[float, float]
    height: float  # above where it lay [m]

    def __post_init__(self):
        _check(self, "take")
        height = float(arguments.numbers("Lift: height", self.height, ()))
        if not 0 < height <= 100:
            raise ValueError(f"Lift: height: found {height:.6g}, expected above 0 to 100")


@dataclasses.dataclass(frozen=True)
class Fold:
    """Stages follow each other; the hands of one stage carry together."""
    scene: str  # of one sheet that lies on the plane z = 0
    stages: tuple[tuple[Carry | Lift, ...], ...]

    def __post_init__(self):
        if not isinstance(self.stages, (tuple, list)) or not self.stages:
            raise ValueError(f"Fold: stages: found {self.stages!r:.60}, expected one or more tuples of Carry or Lift")
        for number, stage in enumerate(self.stages):
            if not isinstance(stage, (tuple, list)) or not stage or not all(isinstance(each, (Carry, Lift)) for each in stage):
                raise ValueError(f"Fold: stages[{number}]: found {stage!r:.60}, expected a tuple of one or more Carry or Lift")
            for what in ("hand", "take"):
                if len({getattr(carry, what) for carry in stage}) < len(stage):
                    raise ValueError(f"Fold: stages[{number}]: found one {what} twice, expected each once")

    @property
    def hands(self):
        return sorted({carry.hand for stage in self.stages for carry in stage})


def _check(carry, *places):
    what = type(carry).__name__
    if not arguments.text(f"{what}: hand", carry.hand):
        raise ValueError(f"{what}: hand: found '', expected a name")
    for name in places:
        place = arguments.numbers(f"{what}: {name}", getattr(carry, name), (2,))
        if not ((0 <= place) & (place <= 1)).all():
            raise ValueError(f"{what}: {name}: found {tuple(place)}, expected shares from 0 to 1")


FOLDS = {
    # The corner at left-top onto the one at right-bottom.
    "towel": Fold(str(SCENES / "towel.json"), ((Carry("hand", (0, 1), (1, 0)),),)),
    # The distant corners onto the adjacent ones.
    "towel_two_arms": Fold(str(SCENES / "towel.json"),
                           ((Carry("left", (0, 1), (0, 0)), Carry("right", (1, 1), (1, 0))),)),
    # The sleeves over the front, about the sides, then the hem up to the shoulders.
    "tshirt": Fold(str(SCENES / "tshirt.json"),
                   ((Carry("left", (0, 0.7), (0.41, 0.7)),), (Carry("right", (1, 0.7), (0.59, 0.7)),),
                    (Carry("left", (0.25, 0), (0.25, 0.9)), Carry("right", (0.75, 0), (0.75, 0.9))))),
    # The left half over the right one, then the hems up, and what is left once more.
    "shorts": Fold(str(SCENES / "shorts.json"),
                   ((Carry("left", (0, 0), (1, 0)), Carry("right", (0.05, 1), (0.95, 1))),
                    (Carry("left", (0.57, 0), (0.55, 0.65)), Carry("right", (1, 0), (0.97, 0.65))),
                    (Carry("left", (0.55, 0.35), (0.53, 1)), Carry("right", (0.97, 0.35), (0.95, 1))))),
    # The corner at left-top, held above where it lay. Without self-contact, so that a CUDA device steps it too.
    "lift": Fold(str(SCENES / "towel_without_layers.json"), ((Lift("hand", (0, 1), 0.2),),)),
}
