"""The viewer as a browser shows it, in headless Chromium where there is one, and what its page does when somebody uses it."""
import pathlib
import re
import signal
import socket
import subprocess
import sys

import numpy as np
import pytest
import view_fixtures as made
from conftest import write_scene
from devtools import Chromium, browser, wait_for

viser = pytest.importorskip("viser", reason="found no package viser: pip install viser")
from flash_sim.view import page, recording, run, scene  # noqa: E402

WIDTH, HEIGHT = 900, 600  # [px]
PANEL, TOAST = 510, 190  # right of one stands the panel, above the other what viser says of a machine without graphics [px]


class Viewer:
    """The program in a process of its own."""

    def __init__(self, *arguments):
        self.process = subprocess.Popen([sys.executable, "-P", "-m", "flash_sim.view", *map(str, arguments)], stdout=subprocess.PIPE,
                                        stderr=subprocess.PIPE, text=True)
        line = self.process.stdout.readline()
        found = re.search(r"http://127\.0\.0\.1:(\d+)/", line)
        if not found:
            self.process.kill()
            raise AssertionError(f"it says {line!r} {self.process.stderr.read()!r}")
        self.address, self.port = found[0], int(found[1])

    def end(self):
        """Exit code and stderr after SIGTERM, which ends it as Ctrl-C does."""
        self.process.send_signal(signal.SIGTERM)
        _, err = self.process.communicate(timeout=60)
        return self.process.returncode, err


def has_cloth_and_points(picture):
    """Whether enough of it (h, w, 3) is blue, as the cloth, and orange, as 50 points of a few pixels are."""
    red, green, blue = np.moveaxis(picture, 2, 0)
    return (blue - red > 40).mean() > 0.05 and ((red - blue > 100) & (green - blue > 40)).mean() > 3e-4


@pytest.mark.skipif(not browser.program(), reason="found no chromium: apt-get install chromium")
def test_the_page_shows_cloth_over_points_and_plays(tmp_path):
    viewer = Viewer("run", made.write_run(tmp_path / "run"), "--port", "0")
    try:
        with Chromium(viewer.address, tmp_path / "profile", WIDTH, HEIGHT) as chromium:
            wait_for(lambda: has_cloth_and_points(chromium.pixels()[TOAST:, :PANEL]))
            chromium.click("Play")
            wait_for(lambda: "Pause" in chromium.buttons())
            assert not [line for line in chromium.log if line.startswith("error")], chromium.log
    finally:
        ended = viewer.end()
    assert ended == (0, "")


def test_a_port_in_use_gives_way_to_the_next_and_no_other_machine_reaches_it(tmp_path):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        viewer = Viewer("recording", made.write_recording(tmp_path / "lift"), "--port", min(taken.getsockname()[1], 64535))
        assert viewer.port != taken.getsockname()[1]
        listening = pathlib.Path("/proc/net/tcp").read_text().split("\n")
        assert any(f"0100007F:{viewer.port:04X}" in line for line in listening)
        assert not any(f"00000000:{viewer.port:04X}" in line for line in listening)
        assert viewer.end() == (0, "")


@pytest.fixture
def server():
    opened = page.open_page("test", 0)
    yield opened
    opened.stop()


def controls(server, kind):
    """Those of a kind on the page, by label."""
    return {handle.label: handle for handle in server.gui._gui_input_handle_from_uuid.values() if type(handle).__name__ == kind}


def test_choosing_a_motion_shows_its_surface(tmp_path, server):
    made.write_run(tmp_path / "run")
    made.write_replay(tmp_path / "stiff", [mesh + [0, 0, 0.01] for mesh in made.LIFTED])
    tick = run.show(server, run.load_runs([tmp_path / "run", tmp_path / "stiff"]))
    tick()
    surface = server.scene._handle_from_node_name["/simulated"]
    assert np.allclose(surface.vertices, made.LIFTED[2])
    controls(server, "GuiSliderHandle")["frame"].value = 1
    controls(server, "GuiDropdownHandle")["motion"].value = str(tmp_path / "stiff")
    tick()
    assert np.allclose(server.scene._handle_from_node_name["/simulated"].vertices, made.LIFTED[1] + [0, 0, 0.01])


def test_a_recording_shows_its_gripper_force_and_camera(tmp_path, server):
    loaded = recording.load_recording(made.write_recording(tmp_path / "lift"), [made.write_camera(tmp_path / "top")])
    tick = recording.show(server, loaded)
    tick()
    nodes = server.scene._handle_from_node_name
    assert np.allclose(nodes["/seen"].points, made.SEEN[2], atol=1e-6)
    assert np.allclose(nodes["/gripper/gripper"].position, [0.1, 0.1, 0.1])
    assert np.allclose(nodes["/gripper/gripper"].wxyz, [0.5**0.5, 0, 0, 0.5**0.5])
    assert np.allclose(nodes["/camera/top"].position, [0, 0, 0.5])
    start, end = nodes["/force/gripper"].points[0]
    assert np.allclose(start, [0.1, 0.1, 0.1]) and np.allclose((end - start)[:2], 0) and end[2] < start[2]


def press(server, label):
    """Clicks a button; what it calls has run when this returns."""
    button = controls(server, "GuiButtonHandle")[label]
    button.value = True


def test_buttons_step_a_scene_play_it_and_bring_it_back(tmp_path, server):
    sim = scene.start(write_scene(tmp_path))
    tick = scene.show(server, sim)

    def steps():
        tick()
        return int(sim.status()["steps"][0])
    assert steps() == 0
    press(server, "Step")
    assert [steps(), steps()] == [1, 1]
    press(server, "Play")
    while steps() < 5:
        pass
    press(server, "Pause")
    now = steps()
    assert steps() == now
    press(server, "Reset")
    assert [steps(), steps()] == [0, 0]


def test_a_timeline_plays_again_and_again(server):
    timeline = page.Timeline(server, [0.0, 0.02, 0.03])
    assert [timeline.frame(), timeline.frame()] == [0, 0]
    press(server, "Play")
    seen = [timeline.frame()]
    while len(seen) < 4:
        frame = timeline.frame()
        if frame != seen[-1]:
            seen.append(frame)
    assert seen == [1, 2, 0, 1]
