"""Arguments of calls as numbers that the simulation takes, or an error that names what was found and what was expected."""
import os

import numpy as np

from flash_sim.device_array import on_host

FARTHEST = 1e5  # that anything is placed [m], as in scenes
UNIT_TOLERANCE = 1e-3  # of the length of a quaternion, as in files of trajectories


def numbers(what, value, *shapes):
    """`value` as a dense array of float64 and of one of `shapes`, whose None stands for any length."""
    array = _array(what, value)
    if array.dtype.kind not in "fiu":
        raise TypeError(f"{what}: found {_kind(value)}, expected numbers")
    if shapes and not any(_fits(array.shape, shape) for shape in shapes):
        raise ValueError(f"{what}: found the shape {array.shape}, expected {' or '.join(map(_name, shapes))}")
    array = np.ascontiguousarray(array, np.float64).reshape(array.shape)
    if not np.isfinite(array).all():
        at = tuple(int(k) for k in np.argwhere(~np.isfinite(array))[0])
        raise ValueError(f"{what}: found {array[at]} at {at}, expected finite numbers")
    return array


def _array(what, value):
    """Of numpy; of what is on a CUDA device a copy."""
    if np.ma.is_masked(value):
        raise TypeError(f"{what}: found an array with a mask, expected one without: leave out what it hides")
    try:
        return np.asarray(on_host(value))
    except Exception as error:  # a tensor on another device, nested lists of different lengths
        line = " ".join(str(error).split())
        raise TypeError(f"{what}: found {_kind(value)} ({line}), expected an array of the CPU or of CUDA") from error


def per_environment(what, value, count):
    """A number, or one for each of `count` environments, as an array of `count`."""
    return np.array(np.broadcast_to(numbers(what, value, (), (count,)), (count,)))


def poses(what, value, current):
    """Poses, a row for each row of `current`: (7,) or (n, 7); of (3,) or (n, 3) the orientation is that of `current`."""
    count = len(current)
    given = numbers(what, value, (7,), (3,), (count, 7), (count, 3))
    rows = np.broadcast_to(given, (count, given.shape[-1]))
    places(what, rows[:, :3])
    if rows.shape[1] == 3:
        rows = np.concatenate([rows, current[:, 3:]], axis=1)
    length = np.linalg.norm(rows[:, 3:], axis=1)
    wrong = np.flatnonzero(~(np.abs(length - 1) <= UNIT_TOLERANCE))
    if len(wrong):
        raise ValueError(f"{what}: found a quaternion of length {length[wrong[0]]:.6g} in row {wrong[0]}, expected 1")
    return np.ascontiguousarray(rows)


def places(what, rows):
    """Throws where a row is farther away than anything is placed."""
    far = np.argwhere(np.abs(rows) > FARTHEST)
    if len(far):
        raise ValueError(f"{what}: found {rows[tuple(far[0])]:.6g} m in row {far[0][0]}, expected at most {FARTHEST:.0f} m")


def truths(what, value, count):
    """A bool, or one for each of `count` environments, as an array of `count`."""
    array = _array(what, value)
    if array.dtype != bool:
        raise TypeError(f"{what}: found {_kind(value)}, expected True or False")
    if array.shape not in ((), (count,)):
        raise ValueError(f"{what}: found the shape {array.shape}, expected () or {_name((count,))}")
    return np.broadcast_to(array, (count,))


def environments(what, value, count):
    """Numbers of environments: None for all of `count`, a number, several, or a mask of `count` bools."""
    if value is None:
        return list(range(count))
    array = np.atleast_1d(_array(what, value))
    if array.dtype == bool:
        if array.shape != (count,):
            raise ValueError(f"{what}: found a mask of the shape {array.shape}, expected {_name((count,))}")
        return np.flatnonzero(array).tolist()
    if array.size == 0:
        return []
    if array.dtype.kind not in "iu":
        raise TypeError(f"{what}: found {_kind(value)}, expected numbers of environments, a mask or None")
    if array.ndim != 1:
        raise ValueError(f"{what}: found the shape {array.shape}, expected one list")
    ids = array.tolist()
    for number in ids:
        if not 0 <= number < count:
            raise ValueError(f"{what}: found environment {number}, expected 0 to {count - 1}")
    if len(set(ids)) < len(ids):
        raise ValueError(f"{what}: found an environment twice, expected each once")
    return ids


def whole_number(what, value, least, most=2**31 - 1):
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)):
        raise TypeError(f"{what}: found {_kind(value)}, expected a whole number")
    if not least <= value <= most:
        raise ValueError(f"{what}: found {value}, expected {least} to {most}")
    return int(value)


def text(what, value):
    if not isinstance(value, str):
        raise TypeError(f"{what}: found {_kind(value)}, expected a name")
    try:
        value.encode()
    except UnicodeEncodeError:
        raise ValueError(f"{what}: found {value!r:.60}, half of a character, expected a name that is text") from None
    if "\0" in value:
        raise ValueError(f"{what}: found {value!r:.60}, expected a name without a null character")
    return value


def path(what, value, kind):
    """The path of a file as text. `kind`: what it should be, as "a scene file"."""
    try:
        return text(what, os.fsdecode(value))
    except TypeError:
        raise TypeError(f"{what}: found {value!r:.60}, expected the path of {kind}") from None


def one_of(what, value, known):
    if text(what, value) not in known:
        raise ValueError(f"{what}: found {value!r}, expected {_list(known)}")
    return value


def _list(names):
    return "one of " + ", ".join(map(repr, names)) if names else "no name, as there is none"


def _fits(shape, expected):
    return len(shape) == len(expected) and all(e is None or s == e for s, e in zip(shape, expected))


def _name(shape):
    return "(" + ", ".join("any" if length is None else str(length) for length in shape) + ("," if len(shape) == 1 else "") + ")"


def _kind(value):
    kind = getattr(value, "dtype", None)
    return f"{type(value).__name__} of {kind}" if kind is not None else f"{value!r:.60}"
