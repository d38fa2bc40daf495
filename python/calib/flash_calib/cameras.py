"""Lenses: what is stated of one, and what stands in a file."""
import dataclasses
import os

import numpy as np

from flash_calib import _core, arguments

COEFFICIENTS = (0, 4, 5, 8)  # of the models without distortion, plumb_bob without and with k3, rational_polynomial


@dataclasses.dataclass(frozen=True)
class Camera:
    """A pinhole camera with OpenCV's distortion; all in pixels."""
    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    distortion: tuple[float, ...] = ()  # k1 k2 p1 p2 (k3 (k4 k5 k6)); none: a lens that bends nothing
    # Of fx fy cx cy k1 k2 ..., as far as they are known: (n, n) with n from 4 to 12, zero for what is not stated; None: nothing is.
    covariance: np.ndarray | None = dataclasses.field(default=None, compare=False)

    @property
    def matrix(self) -> np.ndarray:
        """K, (3, 3)."""
        return np.array([[self.fx, 0, self.cx], [0, self.fy, self.cy], [0, 0, 1.0]])


def load_camera(path: str | os.PathLike) -> Camera:
    """The lens of a file: ROS camera_info, Kalibr's camchain, OpenCV's YAML, JSON or .npz. ValueError where it is none.

    A file of flash-calib intrinsics states its covariance too. Width and height are 0 where the file does not say them.
    """
    path = arguments.path("load_camera: path", path, "a file of a lens")
    try:
        values, covariance = _core.load_camera(path)
    except (ValueError, RuntimeError) as error:
        raise ValueError(f"load_camera: {error}") from None
    return camera_of(values, covariance)


def camera_of(values, covariance=None):
    """Of width, height, fx, fy, cx, cy and coefficients."""
    return Camera(int(values[0]), int(values[1]), *map(float, values[2:6]), distortion=tuple(map(float, values[6:])),
                  covariance=covariance)


def checked(what, camera):
    """The numbers of a camera as the calibration takes them, and its covariance or None."""
    if not isinstance(camera, Camera):
        raise TypeError(f"{what}: found {arguments.kind(camera)}, expected a flash_calib.Camera")
    size = [arguments.whole_number(f"{what}: {name}", getattr(camera, name), 1, 100_000) for name in ("width", "height")]
    focal = [arguments.number(f"{what}: {name}", getattr(camera, name), 1, 1e6) for name in ("fx", "fy")]
    centre = [arguments.number(f"{what}: {name}", getattr(camera, name), -1e6, 1e6) for name in ("cx", "cy")]
    distortion = arguments.numbers(f"{what}: distortion", camera.distortion, (None,))
    if len(distortion) not in COEFFICIENTS:
        raise ValueError(f"{what}: distortion: found {len(distortion)} coefficients, expected one of {COEFFICIENTS}, as k1 k2 p1 p2 k3")
    if np.abs(distortion).max(initial=0) > 1e3:
        raise ValueError(f"{what}: distortion: found {np.abs(distortion).max():.6g}, expected at most 1000")
    return np.array([*size, *focal, *centre, *distortion]), _covariance(f"{what}: covariance", camera.covariance)


def _covariance(what, value):
    if value is None:
        return None
    rows = arguments.numbers(what, value, (None, None))
    if rows.shape[0] != rows.shape[1] or not 4 <= len(rows) <= 12:
        raise ValueError(f"{what}: found the shape {rows.shape}, expected (n, n) with n from 4 to 12")
    known = np.diag(rows) > 0
    part = rows[np.ix_(known, known)]
    sd = np.sqrt(np.diag(part))
    correlation = part / np.outer(sd, sd)
    if (np.diag(rows) < 0).any() or rows[~known].any() or not np.allclose(correlation, correlation.T, atol=1e-6) or not (
            np.linalg.eigvalsh((correlation + correlation.T) / 2) > 1e-12).all():
        raise ValueError(f"{what}: found a matrix that is no covariance, expected one that is symmetric and positive definite")
    return (rows + rows.T) / 2
