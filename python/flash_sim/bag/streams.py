"""Values over time: poses between which one is interpolated, clocks, and which stamps belong together.

Times are whole nanoseconds of the stamps in headers.
"""
from dataclasses import dataclass

import numpy as np

from flash_sim.bag import rigid
from flash_sim.bag.errors import refusal

SECOND = 10**9
LARGEST_GAP = SECOND // 10  # between two poses that one is interpolated from
SAME_STAMP = SECOND // 1000  # nothing moves in between
DAY = 86400 * SECOND


def in_order(stamps):
    """Times (m,) [ns] in order, and which of the stamps (n,) they are: of equal ones the last."""
    order = np.argsort(np.asarray(stamps, np.int64), kind="stable")
    times = np.asarray(stamps, np.int64)[order]
    last = np.append(np.diff(times) > 0, True)
    return times[last], order[last]


class PoseStream:
    """Poses of one frame in another over time."""

    def __init__(self, source, stamps, places, quaternions):
        """source: topic and frames, for messages. stamps (n,) [ns], places (n, 3) [m], quaternions (n, 4) x y z w; they are put in
        order, and of one stamp the last one stays."""
        self.source = source
        self.times, kept = in_order(stamps)
        self._places = np.asarray(places, np.float64)[kept]
        self._quaternions = np.asarray(quaternions, np.float64)[kept]

    def at(self, time):
        """The transform (4, 4) at a time and the gap [ns] between the poses about it; None outside of all."""
        found = bracket(self.times, time)
        if found is None:
            return None
        before, after, share = found
        quaternion = rigid.slerp(self._quaternions[before], self._quaternions[after], share)
        place = (1 - share) * self._places[before] + share * self._places[after]
        return rigid.transform(rigid.rotation_of(quaternion), place), int(self.times[after] - self.times[before])


class FixedPose:
    """A transform that holds at all times."""

    def __init__(self, matrix):
        self.matrix, self.times = matrix, np.empty(0, np.int64)

    def at(self, _):
        """As PoseStream.at."""
        return self.matrix, 0


class PoseProduct:
    """A chain of streams: the product of their transforms, each interpolated by itself."""

    def __init__(self, source, factors):
        """factors: (stream, whether it is inverted), from the base to the tool."""
        self.source, self._factors = source, factors
        moving = [stream.times for stream, _ in factors if len(stream.times)]
        times = np.unique(np.concatenate(moving)) if moving else np.empty(0, np.int64)
        self.times = times[(times >= max(t[0] for t in moving)) & (times <= min(t[-1] for t in moving))] if moving else times

    def at(self, time):
        """As PoseStream.at; the gap is the widest."""
        product, widest = np.eye(4), 0
        for stream, inverted in self._factors:
            found = stream.at(time)
            if found is None:
                return None
            product = product @ (rigid.inverse(found[0]) if inverted else found[0])
            widest = max(widest, found[1])
        return product, widest


@dataclass(frozen=True)
class Pairs:
    """Which stamp of another stream is nearest to each of one."""

    nearest: np.ndarray  # (n,) index into the other stream
    skew: np.ndarray     # (n,) nearest minus own [ns]
    half_frame: int      # what a pair may be apart [ns]

    @property
    def belong(self):
        """(n,) bool."""
        return np.abs(self.skew) <= self.half_frame

    def text(self, name, other):
        """For people to read."""
        apart = np.abs(self.skew) * 1e-6
        return (f"skew of {name} and {other}: {np.median(apart):.1f} ms in the middle, {apart.max():.1f} ms at most; "
                f"half a frame is {self.half_frame * 1e-6:.1f} ms")


def bracket(times, time):
    """(before, after, share) of a time [ns] among those in order; None outside of all. Where they are sparse, one that is within
    1 ms of it is both."""
    if not len(times):
        return None
    after = int(np.searchsorted(times, time))
    before = after - 1
    inside = 0 < after < len(times)
    if not inside or times[after] - times[before] > LARGEST_GAP:
        near = min((k for k in (before, after) if 0 <= k < len(times)), key=lambda k: abs(int(times[k]) - int(time)))
        if abs(int(times[near]) - int(time)) <= SAME_STAMP:
            return near, near, 0.0
    if not inside:
        return None
    return before, after, float(time - times[before]) / float(times[after] - times[before])


def interval(times):
    """The median time between stamps in order [ns]; 0 of fewer than two."""
    return int(np.median(np.diff(times))) if len(times) > 1 else 0


def half_frame(times):
    """What a stamp may be off one of these and still be of the same frame [ns]: at most 50 ms, as robots move meanwhile."""
    return min(interval(times) // 2 or LARGEST_GAP // 2, LARGEST_GAP // 2)


def paired(times, others):
    """Pairs of the stamps `times` with those of `others`, both (n,) in order and not empty."""
    after = np.clip(np.searchsorted(others, times), 1, max(len(others) - 1, 1))
    candidates = np.stack([np.minimum(after - 1, len(others) - 1), np.minimum(after, len(others) - 1)])
    apart = np.abs(others[candidates] - times)
    nearest = candidates[np.argmin(apart, axis=0), np.arange(len(times))]
    return Pairs(nearest, others[nearest] - times, half_frame(times))


def cut(path, name, times, start, end):
    """The times (n,) [ns] of a topic from `start` to `end`, seconds since the first of them; None: all. Throws RecordingError where
    none is left."""
    low = int(times[0]) + round((start or 0) * SECOND)
    high = int(times[0]) + round(end * SECOND) if end is not None else int(times[-1])
    inside = times[(times >= low) & (times <= high)]
    if not len(inside):
        length = (int(times[-1]) - int(times[0])) / SECOND
        raise refusal(path, name, f"found nothing between --from and --until, expected times within its {length:.3g} s")
    return inside


def expect_one_clock(path, name, times, other, others):
    """Throws RecordingError where stamps of two topics are more than a day apart, or do not overlap."""
    if not len(times) or not len(others):
        return
    apart = max(int(times[0]) - int(others[-1]), int(others[0]) - int(times[-1]))
    spans = f"{seconds(times[0])} to {seconds(times[-1])} s on {name}, {seconds(others[0])} to {seconds(others[-1])} s on {other}"
    if apart > DAY:
        raise refusal(path, f"found two clocks: {spans}, expected one: was one stamped by a simulated clock or by a counter?")
    if apart > LARGEST_GAP:
        raise refusal(path, f"found no time that both have: {spans}")


def seconds(stamp):
    """A stamp [ns] as seconds, exactly."""
    stamp = int(stamp)
    return f"{stamp // SECOND}.{stamp % SECOND:09d}"
