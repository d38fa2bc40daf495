"""Depth cameras: what their pictures hold, and where they stand."""
import numpy as np
from numpy.typing import ArrayLike

from flash_sim import _core, arguments
from flash_sim.device_array import CUDA_KINDS, DEFAULT_STREAM

# Of each picture the type of its numbers and the length of a pixel's; () is one number.
PICTURES = {"depth": (np.float32, ()), "distance": (np.float32, ()), "instance": (np.uint8, ()), "triangle": (np.int32, ()),
            "points": (np.float32, (3,))}
NOTHING = 255  # the instance of a pixel that sees nothing


def look_at(position: ArrayLike, target: ArrayLike, up: ArrayLike = (0.0, 0.0, 1.0)) -> np.ndarray:
    """Poses of cameras at `position` whose optical axis goes through `target`, with pictures upright against `up`.

    Each is (3,) or (n, 3) [m], in the base frame. Returns (7,) or (n, 7): x y z qx qy qz qw of the optical frame, x right,
    y down, z forward. A camera that looks straight along `up` has the x axis, or else the y axis, of the base for its right.
    """
    position, target, up = (arguments.numbers(f"look_at: {name}", value, (3,), (None, 3))
                            for name, value in (("position", position), ("target", target), ("up", up)))
    try:
        rows = np.broadcast_arrays(*map(np.atleast_2d, (position, target, up)))
    except ValueError:
        raise ValueError(f"look_at: found {position.shape}, {target.shape} and {up.shape}, "
                         "expected one row or as many of each") from None
    arguments.places("look_at: position", rows[0])
    arguments.places("look_at: target", rows[1])
    forward = _unit("look_at: target", rows[1] - rows[0])
    right = np.cross(forward, _unit("look_at: up", rows[2]))
    along = np.linalg.norm(right, axis=1) < 1e-9
    for axis in np.eye(3)[:2]:
        right[along] = axis - forward[along] * (forward[along] @ axis)[:, None]
        along &= np.linalg.norm(right, axis=1) < 0.5
    right = _unit("look_at: up", right)
    poses = np.concatenate([rows[0], quaternions(np.stack([right, np.cross(forward, right), forward], axis=2))], axis=1)
    return poses if max(position.ndim, target.ndim, up.ndim) == 2 else poses[0]


def quaternions(rotations: np.ndarray) -> np.ndarray:
    """(n, 3, 3) to (n, 4), qx qy qz qw (Shepperd 1978: by the largest of the four)."""
    r = rotations
    diagonal = np.stack([r[:, 0, 0], r[:, 1, 1], r[:, 2, 2]], axis=1)
    trace = diagonal.sum(axis=1)
    # Rows of 4 q q^T - identity, of which the longest is the most exact.
    products = np.empty((len(r), 4, 4))
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        products[:, i, i] = 1 + 2 * diagonal[:, i] - trace
        products[:, i, j] = products[:, j, i] = r[:, i, j] + r[:, j, i]
        products[:, i, 3] = products[:, 3, i] = r[:, k, j] - r[:, j, k]
    products[:, 3, 3] = 1 + trace
    longest = products[np.arange(len(r)), np.argmax(np.einsum("nii->ni", products), axis=1)]
    return longest / np.linalg.norm(longest, axis=1, keepdims=True)


def poses(what: str, value: ArrayLike, count: int) -> np.ndarray:
    """(count, 7) of what may be (7,), (count, 7), or matrices (4, 4), (count, 4, 4), which have to be rigid."""
    given = arguments.numbers(what, value, (7,), (count, 7), (4, 4), (count, 4, 4))
    if given.shape[-1] == 7:
        no_turn = np.tile([0.0, 0, 0, 0, 0, 0, 1], (count, 1))
        return arguments.poses(what, given, no_turn)
    matrices = np.array(np.broadcast_to(given, (count, 4, 4)))
    arguments.places(what, matrices[:, :3, 3])
    turns = matrices[:, :3, :3]
    error = np.abs(np.swapaxes(turns, 1, 2) @ turns - np.eye(3)).max(axis=(1, 2))
    rigid = (error <= arguments.UNIT_TOLERANCE) & (np.linalg.det(turns) > 0) & (matrices[:, 3] == [0, 0, 0, 1]).all(axis=1)
    if not rigid.all():
        raise ValueError(f"{what}: found a matrix that is not rigid in row {np.flatnonzero(~rigid)[0]}, "
                         "expected a rotation, a place and the last row 0 0 0 1")
    return np.concatenate([matrices[:, :3, 3], quaternions(turns)], axis=1)


def pictures(what: str, names, shape: tuple[int, int, int], out: dict | None, device: str) -> dict[str, np.ndarray]:
    """Arrays for the pictures of these names: those of `out`, or new ones of numpy. `device`: where the simulation is."""
    if out is not None:
        if names is not None:
            raise ValueError(f"{what}: found pictures and out, expected one of them: out names its pictures")
        if not isinstance(out, dict):
            raise TypeError(f"{what}: out: found {type(out).__name__}, expected a dict of arrays by the name of the picture")
        if not out:
            raise ValueError(f"{what}: out: found no picture, expected one array or more by the name of the picture, or None")
        found = {name: _checked(f"{what}: out", name, array, shape, device) for name, array in out.items()}
        places = sorted({place for place, _, _ in found.values()})
        if len(places) > 1:
            raise ValueError(f"{what}: out: found arrays on {' and '.join(places)}, expected all on one")
        spans = sorted((start, end, name) for name, (_, start, end) in found.items())
        for (_, end, name), (start, _, other) in zip(spans, spans[1:]):
            if start < end:
                raise ValueError(f"{what}: out: {other}: found the memory of {name}, expected memory of its own")
        return dict(out)
    names = ("depth", "instance") if names is None else (names,) if isinstance(names, str) else names
    try:
        names = list(names)
    except TypeError:
        raise TypeError(f"{what}: pictures: found {type(names).__name__}, expected names of pictures") from None
    for name in names:
        arguments.one_of(f"{what}: pictures", name, list(PICTURES))
    return {name: np.empty(shape + PICTURES[name][1], PICTURES[name][0]) for name in names}


def _checked(what, name, array, shape, device):
    """Where the array is, "cpu" or the device of the simulation, and its first and last address."""
    arguments.one_of(what, name, list(PICTURES))
    kind, pixel = PICTURES[name]
    if isinstance(array, np.ndarray):
        place, dtype, found, dense = "cpu", array.dtype, array.shape, array.flags.c_contiguous and array.flags.writeable
        start, length = array.__array_interface__["data"][0], array.nbytes
    else:
        try:
            if array.__dlpack_device__()[0] not in CUDA_KINDS:
                raise TypeError("not on a CUDA device")
            number, dtype, found, dense, start, length = _core.described(array.__dlpack__(stream=DEFAULT_STREAM))
        except Exception as error:  # of whoever made the array
            raise TypeError(f"{what}: {name}: found {type(array).__name__}, expected an array of {np.dtype(kind)} to write to, of numpy or "
                            "on a CUDA device by DLPack") from error
        place = f"cuda:{number}"
        if place != device:
            raise ValueError(f"{what}: {name}: found an array on {place}, expected " +
                             ("one of numpy" if device == "cpu" else f"one of numpy or on {device}, where it is stepped"))
    if dtype != np.dtype(kind).name:
        raise TypeError(f"{what}: {name}: found {dtype}, expected an array of {np.dtype(kind)}")
    if tuple(found) != shape + pixel:
        raise ValueError(f"{what}: {name}: found the shape {tuple(found)}, expected {shape + pixel}")
    if not dense:
        raise ValueError(f"{what}: {name}: found an array that is strided or read-only, expected a dense one to write to")
    return place, start, start + length


def _unit(what, rows):
    largest = np.abs(rows).max(axis=1, keepdims=True, initial=0)  # the square of 1e200 is no number
    rows = rows / np.where(largest > 0, largest, 1)
    length = np.linalg.norm(rows, axis=1, keepdims=True)
    if not (length > 0).all():
        raise ValueError(f"{what}: found no direction in row {int(np.argmin(length))}, expected one")
    return rows / length
