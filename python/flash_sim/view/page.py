"""The page in the browser: what all views have in common."""
import importlib.util
import logging
import time
from dataclasses import dataclass

import numpy as np

from flash_sim.bag.errors import RecordingError

HOST = "127.0.0.1"  # this machine alone
TICK = 1 / 60  # [s] between two looks at what the page asks for
SLOWEST, FASTEST = 1.0, 0.02  # [s] that a frame is shown while it plays
VIEW_FROM = np.array([0.95, -0.85, 0.6])  # of the camera, from the middle of what there is


def expect_viser():
    """Throws RecordingError where viser is not installed."""
    if importlib.util.find_spec("viser") is None:
        raise RecordingError("found no package viser, which draws the page: pip install 'flash-sim[view]'")


def open_page(title, port):
    """A server of viser that is reached from this machine alone, with nothing on its page but a title. Of a port that is in use
    the next free one is taken, of 0 any."""
    import rich  # of viser, which writes boxes with it
    import viser
    rich.reconfigure(quiet=True)
    logging.getLogger("websockets.server").setLevel(logging.CRITICAL)  # of connections that browsers open and drop
    server = viser.ViserServer(host=HOST, port=port, label=title, verbose=False)
    server.request_share_url = lambda verbose=True: None  # the page may not ask for a tunnel to elsewhere
    server.gui.configure_theme(show_share_button=False, show_logo=False, control_width="large")
    server.scene.set_up_direction("+z")
    return server


def serve(server, title, tick):
    """Prints the address, then calls tick() again and again in this thread until Ctrl-C. All that the page shows is changed there:
    what people set on it is looked at, not waited for."""
    print(f"http://{HOST}:{server.get_port()}/ shows {title}; Ctrl-C ends it", flush=True)
    try:
        while True:
            start = time.monotonic()
            tick()
            time.sleep(max(0.0, TICK - (time.monotonic() - start)))
    finally:
        server.stop()


@dataclass(frozen=True)
class Box:
    """The box about what a view shows [m]."""

    low: np.ndarray
    high: np.ndarray

    @property
    def middle(self):
        return 0.5 * (self.low + self.high)

    @property
    def size(self):
        """Of its diagonal, 1 cm at least."""
        return max(float(np.linalg.norm(self.high - self.low)), 0.01)


def box_about(clouds):
    """The Box of points (n, 3) in a list; of none one of a metre about the origin."""
    points = [cloud for cloud in clouds if len(cloud)]
    if not points:
        return Box(np.full(3, -0.5), np.full(3, 0.5))
    return Box(np.min([cloud.min(axis=0) for cloud in points], axis=0), np.max([cloud.max(axis=0) for cloud in points], axis=0))


def furnish(server, box, ground=True, around=()):
    """Axes at the origin, a grid of 5 cm at the lowest height of the box, and a view of all of it and of places (3,) `around`."""
    step = 0.05 if box.size < 2 else 0.5
    if ground:
        server.scene.add_grid("/grid", width=40 * step, height=40 * step, cell_size=step, section_size=10 * step,
                              position=(*(np.round(box.middle[:2] / step) * step), box.low[2] - 0.002 * box.size))
    server.scene.add_frame("/base", axes_length=0.12 * box.size, axes_radius=0.003 * box.size)
    seen = box_about([np.stack([box.low, box.high, *around])])
    server.initial_camera.fov = 0.7
    server.initial_camera.look_at = seen.middle
    server.initial_camera.position = seen.middle + 1.5 * seen.size * VIEW_FROM / np.linalg.norm(VIEW_FROM)
    server.initial_camera.near = 0.02 * box.size


class Folded:
    """Words that are folded away; a folder without any is not there."""

    def __init__(self, server, title):
        self._folder = server.gui.add_folder(title, expand_by_default=False)
        with self._folder:
            self._words = server.gui.add_markdown("")

    def show(self, words):
        """words: markdown."""
        self._words.content, self._folder.visible = words, bool(words)


class Timeline:
    """A slider over times, and a button that plays them at their own pace, again and again."""

    def __init__(self, server, times, first=0):
        self._slider = server.gui.add_slider("frame", 0, 1, 1, 0)
        self._time = server.gui.add_text("time", "", disabled=True)
        self._button = server.gui.add_button("Play")
        self._playing, self._due = False, 0.0
        self.set_times(times)
        self._slider.value = min(first, len(times) - 1)

        @self._button.on_click
        def _(_):
            self._playing = not self._playing
            self._button.label = "Pause" if self._playing else "Play"

    def set_times(self, times):
        """(n,) [s], at least one."""
        self._times = np.asarray(times, float)
        self._slider.max = max(len(times) - 1, 1)
        self._slider.disabled = self._button.disabled = len(times) < 2

    def frame(self):
        """Which is to be shown now."""
        now = time.monotonic()
        frame = min(int(self._slider.value), len(self._times) - 1)
        if self._playing and now >= self._due:
            frame = (frame + 1) % len(self._times)
            self._slider.value = frame
            after = self._times[frame + 1] - self._times[frame] if frame + 1 < len(self._times) else SLOWEST
            self._due = now + float(np.clip(after, FASTEST, SLOWEST))
        self._time.value = f"{self._times[frame]:.3f} s"
        return frame
