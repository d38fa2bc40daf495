"""Answers of hand-eye calibration, as they were found or as a file has them."""
import dataclasses
import json
import math
import os
import pathlib
import tempfile

import numpy as np

from flash_calib import _core, arguments
from flash_calib.cameras import Camera

CANNOT_BE_USED = "; the answer cannot be used"


@dataclasses.dataclass(frozen=True)
class HeldOut:
    """Root mean squares of what views left out were predicted to, an answer of the others each."""
    translation: float  # of the target [m]
    rotation: float  # of the target [rad]
    corners: float | None  # in the picture [px]; None of pairs of poses


@dataclasses.dataclass(frozen=True)
class Noise:
    """What was found of the noise, an axis. Of pairs of poses it is that of robot and camera together."""
    rotation: float  # of the robot [rad]
    translation: float  # of the robot [m]
    corners: float | None  # [px]; None of pairs of poses
    across_sight: float | None  # of pairs of poses: of the target's place across the line of sight [m]
    along_sight: float | None  # and along it [m]


@dataclasses.dataclass(frozen=True)
class Size:
    """Of the target, over the stated one. The answer is for `estimate`."""
    estimate: float
    sd: float  # 0: it was not solved for
    prior_sd: float | None  # what it was known to before; None: nothing was known
    wanted: float | None  # what the views alone say; None: they do not tell it
    wanted_sd: float | None


@dataclasses.dataclass(frozen=True)
class Weakest:
    """The direction that the views tell least, with its standard deviation."""
    name: str
    translation: float  # [m]
    rotation: float  # [rad]


@dataclasses.dataclass(frozen=True, eq=False)
class Lens:
    """The lens that the answer holds with: use both together."""
    camera: Camera
    sd: np.ndarray  # (9,) of fx fy cx cy k1 k2 p1 p2 k3; 0: not solved for
    stated: Camera
    excluded: bool  # the pictures exclude the lens that was stated


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Calibration:
    """Where a camera is. Where `usable` is False, the answer must not be used, and `refusals` say why."""
    setup: str  # "eye-in-hand" or "eye-to-hand"
    parent: str  # of T: the gripper, or the robot's base
    child: str  # of T: the camera
    T: np.ndarray  # (4, 4) T_gripper_camera (eye-in-hand) or T_base_camera (eye-to-hand) [m]
    covariance: np.ndarray  # (6, 6) of T, with what the robot's errors share over all views [m, rad]
    repeatable: np.ndarray | None  # (6, 6) of what scatters alone: what another such recording would differ by; None of a file
    sd: np.ndarray  # (6,) deviations along and about the axes of the parent [m, rad]; NaN where nothing is told
    target_pose: np.ndarray  # (4, 4) T_base_target (eye-in-hand) or T_gripper_target (eye-to-hand) [m]
    usable: bool  # False where flash-calib ends with exit code 3
    refusals: list[str]  # why it is not usable, worst first
    warnings: list[str]  # worst first; refusals are among them
    used: np.ndarray  # (N,) bool: the views that the answer is of
    reasons: list[str | None]  # N: why a view was left out
    held_out: HeldOut
    noise: Noise
    size: Size | None
    focal_length: Size | None  # of pairs of poses, where it was solved for: over that with which the target's poses were made
    weakest: Weakest
    lens: Lens | None  # None of pairs of poses
    summary: dict  # all of the file "flash-extrinsics/2"
    text: str  # that file

    def save(self, path: str | os.PathLike):
        """Writes the file "flash-extrinsics/2", whole or not at all, which flash's programs and load() read."""
        path = pathlib.Path(arguments.path("save: path", path, "a file"))
        handle, beside = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
        try:
            with open(handle, "w", encoding="utf-8") as file:
                file.write(self.text)
            mask = os.umask(0)
            os.umask(mask)
            os.chmod(beside, 0o666 & ~mask)
            os.replace(beside, path)
        except BaseException:
            os.unlink(beside)
            raise

    def __repr__(self):
        x, y, z = self.T[:3, 3]
        mm, deg = 1e3 * self.sd[:3].max(), math.degrees(self.sd[3:].max())
        return (f"Calibration({self.parent} <- {self.child}: ({x:.5f}, {y:.5f}, {z:.5f}) m +- {mm:.2f} mm, {deg:.3f} deg, "
                f"{self.used.sum()} of {len(self.used)} views, usable={self.usable})")


def load(path: str | os.PathLike, despite_doubts: bool = False) -> Calibration:
    """Reads an answer that flash-calib or Calibration.save wrote. ValueError names what is wrong with the file.

    An answer that is not usable is refused, unless `despite_doubts`.
    """
    path = arguments.path("load: path", path, "a file of flash-calib")
    try:
        found = _core.load(path, arguments.truth("load: despite_doubts", despite_doubts))
        return calibration_of(found, json.loads(found["text"]))
    except KeyError as error:
        raise ValueError(f"load: {path}: found no {error.args[0]}, expected what flash-calib handeye writes") from None
    except (ValueError, RuntimeError) as error:
        named = str(error) if str(path) in str(error) else f"{path}: {error}"
        raise ValueError(arguments.as_arguments(f"load: {named}")) from None


def calibration_of(found, summary):
    """Of what the extension gives, and of the file."""
    def read(name, make, optional=False):
        """make(the field); a ValueError that names it where it is of another shape."""
        value = summary.get(name) if optional else summary[name]
        try:
            return make(value)
        except (TypeError, ValueError, AttributeError, IndexError):
            raise ValueError(f"{name}: found {str(value)[:40]}, expected what flash-calib handeye writes") from None

    warnings = read("warnings", lambda lines: [_text(line) for line in lines])
    refusals = found.get("refusals", [line.removesuffix(CANNOT_BE_USED) for line in warnings if line.endswith(CANNOT_BE_USED)])
    parent, child = read("transform", lambda t: (_text(t["parent"]), _text(t["child"])))
    used, reasons = read("views", lambda views: (np.array([view["used"] for view in views], bool), [view["reason"] for view in views]))
    return Calibration(
        setup=summary["setup"], parent=parent, child=child, T=found["T"], covariance=found["covariance"],
        repeatable=found.get("repeatable"), sd=read("predicted_sd", _deviations), target_pose=found["target_pose"],
        usable=summary["exit_code"] == 0, refusals=[arguments.as_arguments(line) for line in refusals],
        warnings=[arguments.as_arguments(line) for line in warnings], used=used, reasons=reasons,
        held_out=read("residuals", lambda r: HeldOut(r["heldout_mm"] / 1e3, math.radians(r["heldout_deg"]), r["heldout_px"])),
        noise=read("sigmas", lambda s: Noise(s["robot_rotation_rad"], s["robot_translation_m"], s["corner_px"],
                                             s.get("across_sight_m"), s.get("along_sight_m"))),
        size=read("scale", _size, optional=True), focal_length=read("focal_length", _size, optional=True),
        weakest=read("observability", lambda w: Weakest(w["weakest"], w["weakest_mm"] / 1e3, math.radians(w["weakest_deg"]))),
        lens=read("lens", _lens, optional=True), summary=summary, text=found["text"])


def _text(value):
    if not isinstance(value, str):
        raise TypeError
    return value


def _deviations(sd):
    """null: not told."""
    along, about = (np.array(sd[name], float) for name in ("translation_parent_mm", "rotation_parent_deg"))
    return np.concatenate([along / 1e3, np.radians(about)])


def _size(scale):
    if scale is None:
        return None
    return Size(scale["estimate"], scale["sd"], scale["prior_sd"], scale.get("wanted"), scale.get("wanted_sd"))


def _lens(lens):
    if lens is None:
        return None

    def camera(part):
        return Camera(*lens["size_px"], *part["focal_px"], *part["centre_px"], tuple(part["distortion"]))

    return Lens(camera(lens), np.array(lens["sd"], float), camera(lens["stated"]), lens["stated_excluded"])
