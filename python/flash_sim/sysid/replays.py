"""Recordings simulated again, and how far that is from what was seen."""
import collections.abc
import dataclasses
import os
import threading
import warnings

import numpy as np

from flash_sim import _core, arguments
from flash_sim.asset import Asset
from flash_sim.sysid.recordings import Recording

KEPT = 4  # replays of a recording that stay ready, each for an asset and settings
LOCK = threading.Lock()  # of those


class SolverWarning(UserWarning):
    """Steps of a motion were not solved to the tolerance."""


@dataclasses.dataclass(eq=False, repr=False)
class Motion:
    """A recording as it was simulated, at T equal times. The arrays are the caller's: distances reads them as they are then.

    V vertices are those of the mesh that was simulated, which may be finer than the recording's; of a solid those of its
    surface.
    """
    recording: Recording
    values: dict[str, float]  # parameters of the material, and those that were given, in the units of parameters()
    mesh: str  # what was simulated, in words
    times: np.ndarray  # (T,) [s]
    positions: np.ndarray  # (T, V, 3) in the frame of the recording [m]
    triangles: np.ndarray  # (triangles, 3) int
    rest: np.ndarray  # (V, 3) at rest, in the frame of the object [m]
    forces: np.ndarray  # (T - 1, 3) of the last gripper on the object in each step, 0 without a grasp [N]
    converged: bool  # every step was solved to the tolerance
    accepted: bool  # at most 1 % of the steps were not, none with a residual above 1: flash-sysid replay ends with 0
    unconverged_share: float  # of the steps
    residual_max: float  # of a step, over the weight of the object
    penetration_max: float  # into the table [m]
    notices: list[str]  # what was understood of the recording and the asset
    _prepared: _core.PreparedReplay = dataclasses.field(compare=False)

    def __repr__(self):
        given = ", ".join(f"{name}={value:.4g}" for name, value in self.values.items())
        return f"Motion({self.recording.name!r}: {self.positions.shape} positions, {given}, accepted={self.accepted})"


@dataclasses.dataclass(eq=False)
class Distances:
    """How far a motion is from what was seen. K keyframes; a list over them has an array for each, a distance a point.

    observed = R(yaw) (simulated - pivot) + pivot + offset, and an observation at t is of the simulated time t + time_offset.
    """
    times: np.ndarray  # (K,) [s]
    weights: np.ndarray  # (K,) in the score; 0 of a keyframe that does not count
    clouds: list[np.ndarray]  # to the surface [m]
    contours: list[np.ndarray]  # to its border [m]
    markers: list[np.ndarray]  # to where they were put [m]
    scores: np.ndarray  # (K,) as flash-sysid has them: robust mean over the points [m]
    score: float  # mean of the scores by weight [m]
    offset: np.ndarray  # (3,) [m]
    yaw: float  # [rad]
    time_offset: float  # [s]
    bounds_hit: list[str]  # which of them stand at their bound: "offset_x", "yaw", "time", ...


def parameters() -> dict[str, dict]:
    """What can be given to replay: {name: {"unit", "low", "high", "meaning"}}; values outside low and high are refused."""
    return {name: {"unit": unit or "1", "low": low, "high": high, "meaning": meaning}
            for name, unit, low, high, meaning in _core.parameters()}


def replay(recording: Recording, values: collections.abc.Mapping[str, float] | None = None, *,
           asset: str | os.PathLike | Asset | None = None, mesh: str | os.PathLike | None = None, time_step: float = 0.01,
           iterations: int = 60, tolerance: float = 1e-3, grasp_shape: str | None = None, grasp_within: float | None = None,
           grasp_cell: float | None = None, clamp_slopes: bool = False, self_contact: float | None = None,
           layer_friction: float | None = None, horizon: bool = True, device: str = "cpu", threads: int = 0) -> Motion:
    """Simulates a recording with `values` in place of the asset's, by the names of parameters(): {"bending": 1e-4}.

    It is what `flash-sysid replay` simulates, to the last digit; the arguments are its options (help of that program).
    asset: without one, that which the recording names. Of a tuned asset of this recording the mesh is that of its answer,
    and keyframes beyond its horizon have no weight (`horizon=False` keeps them).
    mesh: a specification, as "sheet:0.3x0.3:0.02", or a file, in place of the recording's. Lengths are in m, time_step in s.
    threads: 0 takes one per processor. A recording keeps its last meshes ready, so that other values of the same settings
    begin at once.

    Other threads of Python run meanwhile, and several may replay one recording at a time. Ctrl-C ends it within a step.
    Where steps are not solved to the tolerance it warns with SolverWarning; Motion tells how many. RuntimeError where the
    simulation diverged, ValueError or TypeError, in a line, for what is refused.
    """
    if not isinstance(recording, Recording):
        raise TypeError(f"replay: recording: found {recording!r:.60}, expected what load gives")
    values = _values(values)
    prepared = _prepared(
        recording, asset=_asset(recording, asset), mesh=_mesh(mesh), time_step=_number("time_step", time_step, 0, strict=True),
        iterations=arguments.whole_number("replay: iterations", iterations, 1, 10_000),
        tolerance=_number("tolerance", tolerance, 1e-12, 1),
        grasp_shape=None if grasp_shape is None else arguments.one_of("replay: grasp_shape", grasp_shape, ["clamp", "point", "pinch"]),
        grasp_within=_optional("grasp_within", grasp_within, 0, strict=True), grasp_cell=_optional("grasp_cell", grasp_cell, 0),
        clamp_slopes=_truth("clamp_slopes", clamp_slopes), self_contact=_optional("self_contact", self_contact, 0, strict=True),
        layer_friction=_layer_friction(self_contact, layer_friction), horizon=_truth("horizon", horizon),
        device=arguments.text("replay: device", device), threads=arguments.whole_number("replay: threads", threads, 0, 1024))
    found = prepared.run(values)
    start, step, steps = prepared.clock()
    motion = Motion(recording, mesh=prepared.mesh(), times=start + step * np.arange(steps + 1), triangles=prepared.triangles(),
                    rest=prepared.rest(), _prepared=prepared, **found)
    if not motion.converged:
        warnings.warn(f"{recording.name}: not converged in {100 * motion.unconverged_share:.4g} % of the steps, residual up to "
                      f"{motion.residual_max:.4g} (accepted: 1 %, and a residual of 1)", SolverWarning, stacklevel=2)
    return motion


def distances(recording: Recording, motion: Motion, *, fit: bool = True, distance: str = "trimmed", trim: float = 0.05,
              huber: float = 0.02, two_sided: bool = False) -> Distances:
    """How far a motion is from what its recording saw, by the code that scores candidates in flash-sysid.

    fit: offset, yaw and clock are fitted within the bounds of the recording; False leaves them at zero.
    distance: how the distances of a keyframe become its score: "trimmed" (a mean without the share `trim` of the largest),
    "mean", or "huber" (beyond `huber` [m] they count less). two_sided: simulated cloth where none was seen counts too.
    """
    motion, positions, forces = _checked("distances", recording, motion)
    return Distances(**motion._prepared.distances(
        positions, forces, _truth("fit", fit, "distances"),
        arguments.one_of("distances: distance", distance, ["trimmed", "mean", "huber"]),
        _number("trim", trim, 0, 0.5, call="distances"), _number("huber", huber, 0, strict=True, call="distances"),
        _truth("two_sided", two_sided, "distances")))


def _checked(call, recording, motion):
    """The motion, and its arrays as the extension takes them."""
    if not isinstance(recording, Recording):
        raise TypeError(f"{call}: recording: found {recording!r:.60}, expected what load gives")
    if not isinstance(motion, Motion):
        raise TypeError(f"{call}: motion: found {motion!r:.60}, expected what replay gives")
    if motion.recording.sha256 != recording.sha256:
        raise ValueError(f"{call}: motion: found one of {motion.recording.source}, expected one of {recording.source}")
    count = motion._prepared.clock()[2]
    return (motion, arguments.numbers(f"{call}: motion.positions", motion.positions, (count + 1, len(motion.rest), 3)),
            arguments.numbers(f"{call}: motion.forces", motion.forces, (count, 3)))


def _prepared(recording, **settings):
    """The recording made ready, as it is kept of an earlier call. An asset or a mesh that has changed on the disk is read anew."""
    key = (*settings.items(), *(_stamp(settings[name]) for name in ("asset", "mesh")))
    with LOCK:
        prepared = recording._prepared.pop(key, None)
        if prepared is not None:
            recording._prepared[key] = prepared
            return prepared
    prepared = _core.prepare_replay(recording._loaded, **settings)
    with LOCK:
        recording._prepared[key] = prepared
        while len(recording._prepared) > KEPT:
            recording._prepared.pop(next(iter(recording._prepared)))
    return prepared


def _stamp(path):
    try:
        found = os.stat(path)
    except (OSError, ValueError):  # a specification
        return None
    return found.st_mtime_ns, found.st_size


def _values(values):
    """(name, value) of each; what a parameter takes the extension knows."""
    if values is None:
        return []
    if not isinstance(values, collections.abc.Mapping):
        raise TypeError(f"replay: values: found {values!r:.60}, expected numbers by name, as {{'bending': 1e-4}}")
    return [(arguments.text("replay: values", name), float(arguments.numbers(f"replay: values: {name!r:.60}", value, ())))
            for name, value in values.items()]


def _asset(recording, asset):
    if isinstance(asset, Asset):
        return asset.path
    if asset is None and recording.asset is None:
        raise ValueError(f"replay: asset: found none, and {recording.source} names none, expected the path of an asset")
    return arguments.path("replay: asset", recording.asset if asset is None else asset, "an asset file")


def _mesh(mesh):
    if mesh is None:
        return ""
    text = arguments.path("replay: mesh", mesh, "a mesh, or a specification as 'sheet:0.3x0.3:0.02'")
    if not text:
        raise ValueError("replay: mesh: found '', expected None, a specification or a path")
    return text


def _layer_friction(self_contact, layer_friction):
    if layer_friction is not None and self_contact is None:
        raise ValueError(f"replay: layer_friction: found {layer_friction!r:.60} without self_contact, expected both")
    return _optional("layer_friction", layer_friction, 0)


def _optional(name, value, low, strict=False):
    return None if value is None else _number(name, value, low, strict=strict)


def _number(name, value, low, high=np.inf, strict=False, call="replay"):
    number = float(arguments.numbers(f"{call}: {name}", value, ()))
    if not (low < number if strict else low <= number) or number > high:
        expected = f"{'above ' if strict else ''}{low:g}" + (f" to {high:g}" if np.isfinite(high) else "" if strict else " or more")
        raise ValueError(f"{call}: {name}: found {number:.6g}, expected {expected}")
    return number


def _truth(name, value, call="replay"):
    if not isinstance(value, (bool, np.bool_)):
        raise TypeError(f"{call}: {name}: found {value!r:.60}, expected True or False")
    return bool(value)
