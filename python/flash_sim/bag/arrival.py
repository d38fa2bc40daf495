"""How long after its stamp a message arrived. Nothing is timed by it: it tells stamps of two clocks apart, as no stamp can."""
import itertools

import numpy as np

from flash_sim.bag.pictures import stamp_of

LARGEST_DELAY = 300_000_000  # by which what belongs together may arrive apart [ns]
LOOKED_AT = 200              # messages


def delay_of(recording, topic):
    """From the stamps of a topic to the log, in the middle [ns]."""
    delays = []
    for _, time, message in itertools.islice(recording.logged_messages([topic]), LOOKED_AT):
        for stamped in getattr(message, "transforms", [message]):
            delays.append(time - stamp_of(stamped))
    return int(np.median(delays)) if delays else 0


def doubt(delay, other, name, other_name):
    """What to know where messages arrive so far apart; empty where they do not."""
    if abs(delay - other) <= LARGEST_DELAY:
        return ""
    return (f"stamps of {name} lie {(delay - other) * 1e-9:+.3f} s farther before their arrival than those of {other_name}: "
            "do their clocks differ? Synchronise them, or let flash-calib handeye tell")
