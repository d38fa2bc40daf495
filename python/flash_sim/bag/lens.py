"""Lenses: what CameraInfo says of a camera, and the file that the programs read it from."""
from dataclasses import dataclass, replace

import numpy as np

from flash_sim.bag.errors import refusal

# By the names that ROS, RealSense and Orbbec give them; how many coefficients each may have.
PLUMB_BOB = ("", "none", "plumb_bob", "radtan", "brown conrady", "modified brown conrady")
RATIONAL = ("rational_polynomial", "rational")
INVERSE = "inverse brown conrady"


@dataclass(frozen=True)
class Lens:
    """A pinhole camera, optical frame (x right, y down, z forward); pixel (0, 0) is the centre of the upper left pixel."""

    width: int  # [px]
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    model: str = "plumb_bob"        # or rational_polynomial
    distortion: tuple = (0.0,) * 5  # k1 k2 p1 p2 k3, and k4 k5 k6 of rational_polynomial

    @property
    def size(self):
        """As messages say it."""
        return f"{self.width} x {self.height}"

    def seen(self, x, y):
        """Pixels (2, n) of directions x / z and y / z, each (n,), by OpenCV's formula."""
        if any(self.distortion):
            radial, across, down = self._distortion(x, y)
            x, y = x * radial + across, y * radial + down
        return np.stack([self.fx * x + self.cx, self.fy * y + self.cy])

    def directions(self, pixels):
        """x / z and y / z (n, 2) of pixels (n, 2); distortion is inverted by iteration, exact to 1e-9 for usual lenses."""
        plain = (pixels - [self.cx, self.cy]) / [self.fx, self.fy]
        if not any(self.distortion):
            return plain
        x, y = plain.T
        for _ in range(30):
            radial, across, down = self._distortion(x, y)
            x, y = (plain[:, 0] - across) / radial, (plain[:, 1] - down) / radial
        return np.stack([x, y], axis=1)

    def text(self, name="camera"):
        """Of a ROS camera_info YAML file."""
        def matrix(key, rows, columns, values):
            return f"{key}:\n  rows: {rows}\n  cols: {columns}\n  data: [{', '.join(map(_number, values))}]\n"
        k = [self.fx, 0, self.cx, 0, self.fy, self.cy, 0, 0, 1]
        return (f"image_width: {self.width}\nimage_height: {self.height}\ncamera_name: {name}\n"
                + matrix("camera_matrix", 3, 3, k) + f"distortion_model: {self.model}\n"
                + matrix("distortion_coefficients", 1, len(self.distortion), self.distortion)
                + matrix("rectification_matrix", 3, 3, np.eye(3).ravel())
                + matrix("projection_matrix", 3, 4, [*k[:3], 0, *k[3:6], 0, *k[6:], 0]))

    def _distortion(self, x, y):
        """The radial factor, and what is added to x and to y."""
        k1, k2, p1, p2, k3, k4, k5, k6 = (*self.distortion, 0, 0, 0)[:8]
        r2 = x * x + y * y
        radial = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)))
        return radial, 2 * p1 * x * y + p2 * (r2 + 2 * x * x), p1 * (r2 + 2 * y * y) + 2 * p2 * x * y


def lens_of(message, where, rectified=False):
    """The Lens of a CameraInfo; of a rectified picture that of its projection matrix, without distortion.

    Throws RecordingError, which begins with `where`: no focal length, another model than plumb_bob or rational_polynomial, or a
    number of coefficients that the model does not have.
    """
    k, p, d = (np.asarray(_field(message, name), np.float64) for name in "kpd")
    fx, fy, cx, cy = (p[0], p[5], p[2], p[6]) if rectified and p[0] > 0 else (k[0], k[4], k[2], k[5])
    if not (fx > 0 and fy > 0 and np.isfinite([fx, fy, cx, cy]).all()):
        raise refusal(where, f"found a focal length of {fx:.6g} px, expected that of a calibrated camera")
    if not np.isfinite(d).all():
        raise refusal(where, f"found the distortion {', '.join(f'{value:g}' for value in d)}, expected finite numbers")
    lens = Lens(int(message.width), int(message.height), *map(float, (fx, fy, cx, cy)))
    if rectified and p[0] > 0:
        return lens
    model, coefficients = _distortion_of(str(message.distortion_model), d, where)
    return replace(lens, model=model, distortion=coefficients)


def expect_size(lens, width, height, where):
    """Throws RecordingError where pictures of another size stand beside a lens."""
    if (lens.width, lens.height) != (width, height):
        raise refusal(where, f"found a lens of {lens.size} px beside pictures of {width} x {height}, expected the same size")


def _distortion_of(name, d, where):
    word = name.lower() if name.lower() in (*PLUMB_BOB, *RATIONAL) else name.lower().replace("_", " ")
    if word == INVERSE and not d.any():
        word = "plumb_bob"
    if word in PLUMB_BOB or (word in RATIONAL and not d[5:].any()):
        if len(d) > 5 and d[5:].any():
            raise refusal(where, f"found {len(d)} coefficients of {name}, expected at most 5")
        return "plumb_bob", tuple(float(value) for value in (*d, 0, 0, 0, 0, 0)[:5])
    if word in RATIONAL:
        if len(d) < 8 or d[8:].any():
            raise refusal(where, f"found {len(d)} coefficients of {name}, expected 8, or zeros after them")
        return "rational_polynomial", tuple(float(value) for value in d[:8])
    raise refusal(where,
                  f"found the distortion model {name}, expected plumb_bob or rational_polynomial: rectify the pictures, or "
                  "name a lens of such pictures by --camera-info")


def _field(message, name):
    """By its name in ROS 2, or in ROS 1."""
    return getattr(message, name) if hasattr(message, name) else getattr(message, name.upper())


def _number(value):
    """Shortest text that reads as the same float64."""
    return repr(float(value)).removesuffix(".0")
