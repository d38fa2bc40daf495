"""What is folded: scenes, hands, and who carries what where. A stage table as the scripted policy and the reward read it."""
import dataclasses
import pathlib

SCENES = pathlib.Path(__file__).parent / "scenes"


@dataclasses.dataclass(frozen=True)
class Carry:
    """A hand takes the cloth at one place and lays it on another. Both are places on the cloth as it lies flat, as shares of its
    extent: (0, 0) is the least x and y, (1, 1) the most; the vertex nearest to it, of several layers the upper one."""
    hand: str
    take: tuple[float, float]
    lay: tuple[float, float]


@dataclasses.dataclass(frozen=True)
class Fold:
    """Stages follow each other; the hands of one stage carry together."""
    scene: str  # of one sheet that lies on the plane z = 0
    stages: tuple[tuple[Carry, ...], ...]

    @property
    def hands(self):
        return sorted({carry.hand for stage in self.stages for carry in stage})


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
}
