"""How likely motions are, for samplers of one's own."""
import collections.abc

from flash_sim import _core, arguments
from flash_sim.sysid.recordings import Recording
from flash_sim.sysid.replays import Motion, _checked

Motions = Motion | collections.abc.Sequence[Motion]


class Likelihood:
    """The likelihood by which flash-sysid judges parameters (docs/theory.md), of one recording or several.

        likelihood = Likelihood(recording, reference, {"bending": (lower, higher)})
        likelihood.log(replay(recording, {"bending": 1.2e-4}))

    reference: a motion of each recording, near those to be asked about. How distances change with offset, yaw and clock is taken
    there; these are fitted to each motion within their bounds. beside: of each parameter that is estimated, motions at a lower
    and at a higher value, all else as in the reference. They say how distances change with the parameters, and so how wide the
    likelihood of a model that is wrong has to be. repeatability: mean distance between two trials [m].

    A search of flash-sysid adds errors of known shape: of its interpolation, mesh, step, and of what was held. They are of
    its emulator and are not here. So intervals by this likelihood alone leave out what mesh and time step get wrong.
    """

    def __init__(self, recordings: Recording | collections.abc.Sequence[Recording], reference: Motions,
                 beside: collections.abc.Mapping[str, tuple[Motions, Motions]], repeatability: float | None = None):
        self._recordings = _listed(recordings)
        if not self._recordings:
            raise ValueError("Likelihood: recordings: found none, expected one or more")
        if not isinstance(beside, collections.abc.Mapping) or not beside:
            raise ValueError(f"Likelihood: beside: found {beside!r:.60}, expected two motions by name of a parameter, as "
                             "{'bending': (lower, higher)}")
        pairs = []
        for name, pair in beside.items():
            if not isinstance(pair, collections.abc.Sequence) or len(pair) != 2:
                raise ValueError(f"Likelihood: beside: {name}: found {pair!r:.60}, expected motions at a lower and a higher value")
            pairs.append(tuple(self._given(f"Likelihood: beside: {name}", motions) for motions in pair))
        if repeatability is not None:
            repeatability = float(arguments.numbers("Likelihood: repeatability", repeatability, ()))
            if not repeatability >= 0:
                raise ValueError(f"Likelihood: repeatability: found {repeatability:.6g}, expected 0 or more")
        self._likelihood = _core.MotionLikelihood(self._given("Likelihood: reference", reference), pairs, repeatability)

    def log(self, motions: Motions) -> float:
        """The logarithm of the likelihood of a motion of each recording, up to a constant."""
        return self._likelihood.log(self._given("log: motions", motions))

    @property
    def spreads(self) -> list[float]:
        """Of each recording, s of the likelihood: what one distance may miss by [m]."""
        return self._likelihood.spreads()

    def _given(self, what, motions):
        motions = _listed(motions)
        if len(motions) != len(self._recordings):
            raise ValueError(f"{what}: found {len(motions)} motions, expected {len(self._recordings)}, one a recording")
        checked = [_checked(what, recording, motion) for recording, motion in zip(self._recordings, motions)]
        return [(motion._prepared, positions, forces) for motion, positions, forces in checked]


def _listed(given):
    return list(given) if isinstance(given, collections.abc.Sequence) else [given]
