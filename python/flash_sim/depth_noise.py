"""Errors of a depth camera on pictures that have none.

A policy that sees the body alone, cut out of the picture, gets it so:

    clean = sim.render("body only", ("depth",))["depth"]       # a camera with sees=["towel"]
    robot = sim.render("robot only", ("depth",))["depth"]      # one with sees=["hand"], at the same pose
    seen = flash_sim.add_depth_noise(clean, seed=step, robot=robot)

Depth is along the optical axis [m], 0 where there is nothing. Pictures come as (n, height, width) float32. Of each picture chance
depends on the seed and on its number alone: picture 3 of 128 is what it is among 4.
"""
import dataclasses

import numpy as np
from numpy.typing import ArrayLike

from flash_sim import arguments


@dataclasses.dataclass(frozen=True)
class DepthNoise:
    """Sizes of the errors, in the order in which add_depth_noise makes them. 0 leaves an error out."""
    blockouts: int = 2            # rectangles without depth: 0 to so many in a picture, each number as likely
    blockout_size: float = 0.15   # their edges: even from 0 to this share of the picture's
    jitter: float = 0.7           # pixels at a boundary show what lies so far off: standard deviation along each axis [px]
    flying: float = 0.1           # share of the pixels at an edge in depth that lie somewhere between its two sides
    edge: float = 0.02            # neighbours are a boundary where one sees nothing, or where depth jumps by more [m]
    grazing: float = 80.0         # pixels see nothing where the surface is turned farther from the ray [deg]; 90: all see
    noise: float = 1e-3           # of depth: standard deviation [m]
    noise_of_square: float = 0.0  # of depth over its square: standard deviation, independent of the above [1/m]
    step_of_square: float = 0.0   # depth comes in steps of this times its square, as disparity does [1/m]
    robot_margin: int = 1         # the robot hides so many pixels around its picture, too [px]

    def __post_init__(self):
        for name, most in (("blockouts", 1000), ("robot_margin", 1000)):
            arguments.whole_number(f"DepthNoise: {name}", getattr(self, name), 0, most)
        for name, most in (("blockout_size", 1), ("jitter", 1000), ("flying", 1), ("edge", 1e5), ("grazing", 90),
                           ("noise", 100), ("noise_of_square", 100), ("step_of_square", 100)):
            value = float(arguments.numbers(f"DepthNoise: {name}", getattr(self, name), ()))
            if not 0 <= value <= most:
                raise ValueError(f"DepthNoise: {name}: found {value:.6g}, expected 0 to {most:g}")
        if 0 < self.step_of_square < 1e-9:
            raise ValueError(f"DepthNoise: step_of_square: found {self.step_of_square:.6g}, expected 0, or 1e-9 or more")


def add_depth_noise(depth: ArrayLike, seed: int, settings: DepthNoise = DepthNoise(), robot: ArrayLike | None = None,
                    lens: ArrayLike | None = None) -> np.ndarray:
    """Pictures of a body with the errors of a camera, and without what the robot hides: (n, height, width) float32.

    In this order: blockouts; at boundaries jitter and flying pixels; grazing surfaces; noise and steps of depth; the robot.
    depth: of the body alone. robot: the depth of the robot alone; a pixel sees nothing where it, or a pixel within
    robot_margin, has the robot before the body. lens: fx, fy, cx, cy [px], without which nothing counts as grazing.
    """
    clean = _pictures("add_depth_noise: depth", depth)
    seed = arguments.whole_number("add_depth_noise: seed", seed, 0, 2**63 - 1)
    if not isinstance(settings, DepthNoise):
        raise TypeError(f"add_depth_noise: settings: found {type(settings).__name__}, expected DepthNoise")
    before = None if robot is None else _pictures("add_depth_noise: robot", robot)
    if before is not None and before.shape != clean.shape:
        raise ValueError(f"add_depth_noise: robot: found the shape {before.shape}, expected {clean.shape}")
    if lens is not None:
        lens = arguments.numbers("add_depth_noise: lens", lens, (4,))
        if not (lens[:2] >= 1e-3).all():
            raise ValueError(f"add_depth_noise: lens: found the focal lengths {lens[0]:.6g} and {lens[1]:.6g} px, expected 0.001 or more")
    seen = np.empty_like(clean)
    for k, picture in enumerate(clean):
        random = np.random.default_rng([seed, k])
        one = block_out(picture, random, settings.blockouts, settings.blockout_size)
        one = jitter_boundaries(one, random, settings.jitter, settings.edge)
        one = let_fly(one, random, settings.flying, settings.edge)
        if lens is not None:
            one = np.where(angles(picture, lens) > settings.grazing, np.float32(0), one)
        one = blur_depth(one, random, settings.noise, settings.noise_of_square)
        one = in_steps(one, settings.step_of_square)
        seen[k] = one if before is None else hide(one, before[k], settings.robot_margin)
    return seen


def jitter_poses(poses: ArrayLike, seed: int, metres: float = 0.0, degrees: float = 0.0) -> np.ndarray:
    """Poses (n, 7), each moved by Gaussian steps along each axis [m] and turned about each axis of its own frame [deg].

    metres, degrees: standard deviations along each axis.
    """
    given = arguments.numbers("jitter_poses: poses", poses, (None, 7))
    given = arguments.poses("jitter_poses: poses", given, given)
    for what, value, most in (("metres", metres, 1e5), ("degrees", degrees, 360)):
        if not 0 <= arguments.numbers(f"jitter_poses: {what}", value, ()) <= most:
            raise ValueError(f"jitter_poses: {what}: found {value}, expected 0 to {most:g}")
    random = np.random.default_rng(arguments.whole_number("jitter_poses: seed", seed, 0, 2**63 - 1))
    moved = given[:, :3] + metres * random.standard_normal((len(given), 3))
    turn = np.radians(degrees) * random.standard_normal((len(given), 3))
    half = np.linalg.norm(turn, axis=1, keepdims=True) / 2
    x = 0.5 * np.sinc(half / np.pi) * turn  # sin(half) / (2 half) of the turn
    w = np.cos(half)
    a, b = given[:, 3:6], given[:, 6:]
    product = np.concatenate([b * x + w * a + np.cross(a, x), b * w - (a * x).sum(axis=1, keepdims=True)], axis=1)
    return np.concatenate([moved, product / np.linalg.norm(product, axis=1, keepdims=True)], axis=1)


# -- the errors one by one, of one picture (height, width) --------------------------------------------------------------------


def block_out(depth, random, most, size):
    """Rectangles see nothing: 0 to `most` of them, anywhere in the picture, with edges up to `size` of its own."""
    blocked = depth.copy()
    shape = np.array(depth.shape)
    for _ in range(random.integers(most + 1)):
        extent = np.round(random.uniform(0, size, 2) * shape).astype(int)
        first = random.integers(shape - extent + 1)
        blocked[first[0]:first[0] + extent[0], first[1]:first[1] + extent[1]] = 0
    return blocked


def boundaries(depth, edge):
    """Whether one of a pixel's four neighbours is over a boundary: nothing beside something, or a jump of depth over `edge`."""
    found = np.zeros(depth.shape, bool)
    for axis in (0, 1):
        near, far = _neighbours(axis)
        jump = ((depth[near] > 0) != (depth[far] > 0)) | (np.abs(depth[near] - depth[far]) > edge)
        found[near] |= jump
        found[far] |= jump
    return found


def jitter_boundaries(depth, random, pixels, edge):
    """Each pixel at a boundary shows what a pixel near it does: Gaussian steps of standard deviation `pixels` along each axis."""
    rows, columns = np.nonzero(boundaries(depth, edge))
    jittered = depth.copy()
    if pixels > 0 and len(rows):
        steps = np.rint(pixels * random.standard_normal((2, len(rows)))).astype(int)
        from_rows = np.clip(rows + steps[0], 0, depth.shape[0] - 1)
        from_columns = np.clip(columns + steps[1], 0, depth.shape[1] - 1)
        jittered[rows, columns] = depth[from_rows, from_columns]
    return jittered


def let_fly(depth, random, share, edge):
    """A `share` of the pixels on both sides of a jump in depth lies evenly anywhere between the two. Nothing is no side."""
    flown = depth.copy()
    for axis in (0, 1):
        near, far = _neighbours(axis)
        a, b = depth[near], depth[far]
        for own, other, place in ((a, b, near), (b, a, far)):
            rows, columns = np.nonzero((a > 0) & (b > 0) & (np.abs(a - b) > edge))
            chosen = random.random(len(rows)) < share
            rows, columns = rows[chosen], columns[chosen]
            between = random.random(len(rows), np.float32)
            ends = own[rows, columns], other[rows, columns]
            flown[place][rows, columns] = ends[0] + between * (ends[1] - ends[0])
    return flown


def angles(depth, lens):
    """Between the ray of each pixel and the surface's normal [deg]; 0 where a neighbour sees nothing.

    1/z is linear in the picture over a plane: with w = 1/z the normal is (fx dw/du, fy dw/dv, w - (u - cx) dw/du - (v - cy)
    dw/dv), and its product with the ray ((u - cx) / fx, (v - cy) / fy, 1) is w. Exact of a plane.
    """
    fx, fy, cx, cy = lens
    inverse = np.divide(1, depth, out=np.full(depth.shape, np.nan), where=depth > 0)
    slopes = []
    for axis in (0, 1):
        steps = np.diff(inverse, axis=axis)
        blank = np.full_like(np.take(inverse, [0], axis=axis), np.nan)
        two = np.stack([np.concatenate([steps, blank], axis=axis), np.concatenate([blank, steps], axis=axis)])
        # The lesser slope of the two sides: at an edge in depth it is that of the surface.
        two = np.where(np.isnan(two), np.inf, two)
        slopes.append(np.take_along_axis(two, np.abs(two).argmin(axis=0)[None], axis=0)[0])
    dv, du = slopes
    u, v = np.arange(depth.shape[1]) - cx, (np.arange(depth.shape[0]) - cy)[:, None]
    known = np.isfinite(inverse) & np.isfinite(du) & np.isfinite(dv)
    du, dv, w = (np.where(known, array, 0) for array in (du, dv, inverse))
    normal = np.sqrt((fx * du) ** 2 + (fy * dv) ** 2 + (w - u * du - v * dv) ** 2)
    ray = np.sqrt((u / fx) ** 2 + (v / fy) ** 2 + 1)
    cosine = np.divide(w, normal * ray, out=np.ones(depth.shape), where=known & (normal > 0))
    return np.degrees(np.arccos(np.clip(cosine, -1, 1)))


def blur_depth(depth, random, noise, noise_of_square):
    """Depth with Gaussian noise, where there is any. What would come to lie behind the camera sees nothing."""
    seen = depth > 0
    z = depth[seen]
    deviation = np.sqrt(np.float32(noise) ** 2 + (np.float32(noise_of_square) * z * z) ** 2)
    blurred = np.zeros_like(depth)
    blurred[seen] = np.maximum(z + deviation * random.standard_normal(len(z), np.float32), 0)
    return blurred


def in_steps(depth, step_of_square):
    """Depth whose inverse is a whole multiple of `step_of_square` [1/m], where it is not 0."""
    if step_of_square == 0:
        return depth
    seen = depth > 0
    multiples = np.rint(np.divide(1 / step_of_square, depth, out=np.zeros(depth.shape), where=seen))
    return np.divide(1 / step_of_square, multiples, out=np.zeros(depth.shape), where=multiples > 0).astype(np.float32)


def hide(depth, robot, margin):
    """Nothing where the robot stands before the body, at the pixel or at one within `margin` of it along both axes."""
    nearest = np.where(robot > 0, robot, np.float32(np.inf))
    for axis in (0, 1):
        spread = nearest.copy()
        for k in range(1, margin + 1):
            near, far = _neighbours(axis, k)
            np.minimum(spread[near], nearest[far], out=spread[near])
            np.minimum(spread[far], nearest[near], out=spread[far])
        nearest = spread
    return np.where(nearest < depth, np.float32(0), depth)


def _neighbours(axis, distance=1):
    """Places of all pixels that have one so far behind them along an axis, and places of those."""
    near, far = [slice(None)] * 2, [slice(None)] * 2
    near[axis], far[axis] = slice(None, -distance), slice(distance, None)
    return tuple(near), tuple(far)


def _pictures(what, value):
    array = np.asarray(value)
    if array.dtype != np.float32:
        raise TypeError(f"{what}: found {getattr(value, 'dtype', type(value).__name__)}, expected float32")
    if array.ndim != 3:
        raise ValueError(f"{what}: found the shape {array.shape}, expected (n, height, width)")
    if not all(array.shape[1:]):
        raise ValueError(f"{what}: found the shape {array.shape}, whose pictures have no pixel, expected one or more")
    if not ((array >= 0) & np.isfinite(array)).all():
        raise ValueError(f"{what}: found a depth below 0 or none at all, expected 0 or more")
    return array
