"""Recordings as arrays."""
import dataclasses
import os

import numpy as np

from flash_sim import _core, arguments


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Recording:
    """What was seen of an object and what held it, in the base frame. Times count from its first grasp or keyframe.

    K keyframes, V vertices. A list over keyframes has an empty array where nothing was seen.
    """
    source: str  # path of recording.json
    name: str
    kind: str  # "corner_lift", "drag", ...: it documents the experiment
    sha256: str  # of recording.json and the files that it names
    asset: str | None  # path of the asset that it names
    mesh: str  # specification or path
    vertices: np.ndarray  # (V, 3) at rest, in the frame of the object [m]
    triangles: np.ndarray  # (triangles, 3) int, of a solid its outer faces
    tetrahedra: np.ndarray  # (tetrahedra, 4) int; none of a sheet
    start: np.ndarray  # (V, 3) where the object starts [m]
    gravity: np.ndarray  # (3,) [m/s^2]
    table: tuple[np.ndarray, np.ndarray] | None  # a point (3,) [m] and the normal (3,)
    grippers: dict[str, tuple[np.ndarray, np.ndarray]]  # times (P,) [s], poses (P, 7) x y z qx qy qz qw [m]
    grasps: list[dict]  # gripper, from and to [s], shape, vertices (of `vertices`)
    supports: list[dict]  # name, from and to [s], vertices
    loads: list[dict]  # attached_mass [kg], vertices
    crop: tuple[np.ndarray, np.ndarray]  # least and greatest corner (3,), infinite where open [m]
    bounds: dict  # of what is fitted, about zero: offset (3,) [m], yaw [rad], time [s], table_height [m], start_yaw [rad]
    times: np.ndarray  # (K,) of the keyframes [s]
    clouds: list[np.ndarray]  # K of (points, 3) inside the crop [m]
    contours: list[np.ndarray]  # K of (points, 3) of the outline [m]
    markers: list[np.ndarray]  # K of (markers, 3) [m]
    marker_places: list[np.ndarray]  # K of (markers, 3): where each is on the object at rest [m]
    forces: np.ndarray  # (K, 3) of the last gripper on the object, NaN where not measured [N]
    warnings: list[str]  # what is likely wrong
    notices: list[str]  # what a reader should know
    _loaded: _core.LoadedRecording = dataclasses.field(compare=False)
    _prepared: dict = dataclasses.field(default_factory=dict)

    def __repr__(self):
        return (f"Recording({self.name!r}: {len(self.times)} keyframes from {self.times[0]:.3f} to {self.times[-1]:.3f} s, "
                f"{sum(map(len, self.clouds))} points, {len(self.vertices)} vertices)")


def load(path: str | os.PathLike) -> Recording:
    """Reads a recording: its folder, or recording.json (docs/formats.md). ValueError, in a line, for one that cannot be used."""
    loaded = _core.load_recording(arguments.path("load: path", path, "a recording"))
    return Recording(**loaded.fields(), _loaded=loaded)
