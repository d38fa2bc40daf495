"""Arguments of calls as arrays that the calibration takes, or an error that names what was found and what was expected."""
import os
import re

import numpy as np

FARTHEST = 1e4  # that robots and targets are [m], as in files
REACH = 10  # of arms [m]: where half of the poses are beyond, they are in another unit


def numbers(what, value, *shapes, unseen=False):
    """`value` as a dense array of float64 and of one of `shapes`, whose None stands for any length. `unseen`: NaN may stand in it."""
    array = _array(what, value)
    if array.dtype.kind not in "fiu":
        raise TypeError(f"{what}: found {kind(value)}, expected numbers")
    if not any(_fits(array.shape, shape) for shape in shapes):
        raise ValueError(f"{what}: found the shape {array.shape}, expected {' or '.join(map(_name, shapes))}")
    array = np.array(array, np.float64, order="C")
    wrong = np.isinf(array) if unseen else ~np.isfinite(array)
    if wrong.any():
        at = tuple(int(k) for k in np.argwhere(wrong)[0])
        raise ValueError(f"{what}: found {array[at]} at {at}, expected finite numbers")
    return array


def poses(what, value):
    """Poses as (N, 4, 4), (N, 3, 4) or (N, 7), in metres. That rotations are such is looked at where they are read."""
    array = numbers(what, value, (None, 4, 4), (None, 3, 4), (None, 7))
    places = array[:, :3] if array.ndim == 2 else array[:, :3, 3]
    with np.errstate(over="ignore"):
        distances = np.linalg.norm(places, axis=1)
    far = np.flatnonzero(~(distances < FARTHEST))
    if len(far):
        raise ValueError(f"{what}: found pose {far[0]} {distances[far[0]]:.6g} m away, expected metres")
    if len(distances) and np.median(distances) > REACH:
        raise ValueError(f"{what}: found half of the poses beyond {np.median(distances):.6g} m, expected metres (are these "
                         "millimetres? divide by 1,000)")
    if array.shape[1:] == (3, 4):
        array = np.concatenate([array, np.broadcast_to([[[0.0, 0, 0, 1]]], (len(array), 1, 4))], axis=1)
    return np.ascontiguousarray(array)


def number(what, value, least, most):
    found = float(numbers(what, value, ()))
    if not least <= found <= most:
        raise ValueError(f"{what}: found {found:.6g}, expected {least:.6g} to {most:.6g}")
    return found


def whole_number(what, value, least, most):
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)):
        raise TypeError(f"{what}: found {kind(value)}, expected a whole number")
    if not least <= value <= most:
        raise ValueError(f"{what}: found {value}, expected {least} to {most}")
    return int(value)


def truth(what, value):
    if not isinstance(value, (bool, np.bool_)):
        raise TypeError(f"{what}: found {kind(value)}, expected True or False")
    return bool(value)


def text(what, value):
    if not isinstance(value, str):
        raise TypeError(f"{what}: found {kind(value)}, expected text")
    try:
        value.encode()
    except UnicodeEncodeError:
        raise ValueError(f"{what}: found {value!r:.60}, half of a character, expected text") from None
    if "\0" in value:
        raise ValueError(f"{what}: found {value!r:.60}, expected text without a null character")
    return value


def path(what, value, of):
    """The path of a file as text. `of`: what it should be, as "a file of flash-calib"."""
    try:
        return text(what, os.fsdecode(value))
    except TypeError:
        raise TypeError(f"{what}: found {kind(value)}, expected the path of {of}") from None


def one_of(what, value, known):
    if text(what, value) not in known:
        raise ValueError(f"{what}: found {value!r:.60}, expected one of {', '.join(map(repr, known))}")
    return value


def as_arguments(line):
    """A line of the program in which options are arguments of functions: "--target-size solved" becomes "target_size solved"."""
    line = line.replace("(--camera-info writes it)", "(Calibration.lens)")
    return re.sub(r"--(target-size-sd|target-size|camera-height|target-height|lens|setup|despite-doubts)(?![a-z-])",
                  lambda option: option[1].replace("-", "_"), line)


def _array(what, value):
    if np.ma.is_masked(value):
        raise TypeError(f"{what}: found an array with a mask, expected one without: leave out what it hides")
    try:
        return np.asarray(value)
    except Exception as error:  # nested lists of different lengths, a tensor on a device
        line = " ".join(str(error).split())
        raise TypeError(f"{what}: found {kind(value)} ({line:.120}), expected an array of numbers") from None


def _fits(shape, expected):
    return len(shape) == len(expected) and all(e is None or s == e for s, e in zip(shape, expected))


def _name(shape):
    return "(" + ", ".join("any" if length is None else str(length) for length in shape) + ("," if len(shape) == 1 else "") + ")"


def kind(value):
    dtype = getattr(value, "dtype", None)
    return f"{type(value).__name__} of {dtype}" if dtype is not None else " ".join(f"{value!r:.60}".split())
