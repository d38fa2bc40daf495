"""Cameras, and the points that their pictures of depth show."""
import math
from dataclasses import dataclass

import numpy as np

from flash_sim import _core
from flash_sim.bag.errors import refusal


@dataclass(frozen=True, eq=False)
class Camera:
    """A pinhole that stands still. A lens that bends is drawn, and its pictures are, as if it did not."""

    name: str
    pose: np.ndarray  # (4, 4) of the optical frame (x right, y down, z forward) in the base frame
    width: int        # [px]
    height: int
    lens: tuple       # fx, fy, cx, cy [px]
    scale: float      # metres a count of its pictures

    @classmethod
    def of(cls, name, path, pose, scale=1e-3):
        """With the lens of a file. ValueError in one line where it has none."""
        (width, height), lens = _core.load_lens(str(path))
        if not width:
            width, height = round(2 * lens[2] + 1), round(2 * lens[3] + 1)
        return cls(name, pose, width, height, lens, scale)

    @property
    def fov(self):
        """Vertical angle of view [rad]."""
        return 2 * math.atan(0.5 * self.height / self.lens[1])


def points_of(path, camera, mask=None):
    """(n, 3) in the base frame [m] of a picture of depth: 16-bit PNG of counts, or .npy or TIFF of metres. `mask`: a picture that is
    0 where nothing counts. Throws RecordingError."""
    depth = _picture(path)
    depth = depth * camera.scale if depth.dtype.kind in "iu" else depth.astype(float)
    kept = np.isfinite(depth) & (depth > 0)
    if mask is not None:
        kept &= _picture(mask) != 0
    v, u = np.nonzero(kept)
    fx, fy, cx, cy = camera.lens
    z = depth[kept]
    seen = np.stack([(u - cx) / fx * z, (v - cy) / fy * z, z], axis=1)
    return seen @ camera.pose[:3, :3].T + camera.pose[:3, 3]


def _picture(path):
    """(h, w)."""
    try:
        if path.suffix == ".npy":
            pixels = np.load(path, allow_pickle=False)
        else:
            from PIL import Image  # which viser needs as well
            with Image.open(path) as picture:
                pixels = np.array(picture)
    except (OSError, ValueError, EOFError) as error:
        raise refusal(path, f"cannot be read ({getattr(error, 'strerror', None) or 'not a picture'}), expected a 16-bit PNG, or "
                            ".npy or TIFF of metres") from None
    return pixels if pixels.ndim == 2 else pixels.max(axis=2)
