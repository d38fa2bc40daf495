#!/usr/bin/env python3
"""flash-calib watch on a folder that grows picture by picture: its state and its page, what is half written, missing, removed or
broken, and how it ends. The page is looked at in headless Chromium where there is one."""
import argparse
import contextlib
import json
import pathlib
import re
import shutil
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request

import documented
import program

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "documents"))
import browser

TARGET, VIEWS = "charuco:7x5:0.04:0.03:DICT_5X5_100", 6
PATIENCE = 90  # [s] on a machine that is busy


class Watch:
    """The program on a folder, and what it serves."""

    def __init__(self, calib, folder, *options):
        self.process = subprocess.Popen([str(calib), "watch", str(folder), "--port", "0", *options], stdout=subprocess.PIPE,
                                        stderr=subprocess.PIPE, text=True)
        line = self.process.stdout.readline()
        found = re.search(r"http://127\.0\.0\.1:(\d+)/", line)
        if not found:
            raise SystemExit(f"watch says {line!r} {self.process.stderr.read()!r}")
        self.address, self.port = found[0], int(found[1])

    def state(self):
        with urllib.request.urlopen(self.address + "state", timeout=PATIENCE) as reply:
            return json.load(reply)["state"]

    def wait(self, what, holds):
        """The first state of which that holds, and seconds until then."""
        begun, state = time.monotonic(), None
        while time.monotonic() - begun < PATIENCE:
            if self.process.poll() is not None:
                raise SystemExit(f"watch ended with {self.process.returncode} before {what}: {self.process.stderr.read()}")
            state = self.state()
            if state and holds(state):
                return state, time.monotonic() - begun
            time.sleep(0.02)
        raise SystemExit(f"no {what} within {PATIENCE} s: {json.dumps(state)[:2000]}")

    def ended(self, by):
        """Exit code and stderr after a signal."""
        self.process.send_signal(by)
        _, err = self.process.communicate(timeout=PATIENCE)
        return self.process.returncode, err


def status_of(address, method="GET", host=None):
    request = urllib.request.Request(address, method=method, headers={"Host": host} if host else {})
    try:
        with urllib.request.urlopen(request, timeout=PATIENCE) as reply:
            return reply.status
    except urllib.error.HTTPError as error:
        return error.code


def says(state, words):
    return any(words in sentence for sentence in state["waiting"])


def looked_at(name):
    return lambda state: state["last"] and state["last"]["name"] == name and state["last"]["looked_at"]


def answered(views):
    return lambda state: state["answer"] and state["answer"]["views"] == views and not state["solving"]


def check_page(watch, *, words, without=()):
    if not browser.program():
        print("skipped in part: found no chromium, apt-get install chromium")
        return
    page, log = browser.served(watch.address)
    yield not log, f"the page logs {log}"
    body = page[:page.find('<script type="application/json"')]
    for word in words:
        yield word in body, f"the page lacks {word!r}: {body[-3000:]}"
    for word in without:
        yield word not in body, f"the page has {word!r}"


def check_growth(watch, full, live, truth):
    state, _ = watch.wait("first state", lambda state: True)
    yield state["pictures"] == 0 and state["last"] is None, f"an empty folder: {state}"
    yield "first picture" in state["advice"], state["advice"]
    yield from check_page(watch, words=("Waiting for the first picture", "no pictures"), without=("known to",))
    for name in ("camera_info.yaml", "target.json"):
        shutil.copy(full / name, live)
    (live / "images").mkdir()
    rows = [row for row in (full / "poses.tum").read_text().splitlines() if not row.startswith("#")]
    seconds = []

    def add_row(k):
        with open(live / "poses.tum", "a") as poses:
            poses.write(rows[k] + "\n")

    for k in range(VIEWS):
        name = f"{k:03d}.png"
        picture = (full / "images" / name).read_bytes()
        if k != 4:
            add_row(k)
        if k == 3:  # the camera's program is in the midst of it
            (live / "images" / name).write_bytes(picture[:len(picture) // 2])
            state, _ = watch.wait("half picture", lambda state: says(state, f"{name}: not whole yet"))
            yield state["last"]["found"] == 0 and not state["last"]["reason"] == "", f"half a picture: {state['last']}"
        (live / "images" / name).write_bytes(picture)
        state, after = watch.wait(name, lambda state: looked_at(name)(state) and not says(state, "not whole"))
        seconds.append(after)
        yield state["last"]["found"] > 0, f"{name}: {state['last']}"
        yield state["pictures"] == k + 1, f"{name}: {state['pictures']} pictures"
        if k == 4:
            yield says(state, f"{name}: no pose yet") and not state["last"]["has_pose"], f"without its row: {state['waiting']}"
            add_row(k)
        state, _ = watch.wait(f"answer with {name}", answered(k + 1))
        yield not state["waiting"], f"{name}: waits for {state['waiting']}"
        yield (state["answer"]["not_yet"] == "") == (k >= 3), f"{name}: {state['answer']['not_yet']}"
        yield (state["next"] is not None) == (k >= 3), f"{name}: {state['next']}"
    print(f"from a picture written to what was found in it served: median {statistics.median(seconds):.2f} s, "
          f"longest {max(seconds):.2f} s")
    answer = state["answer"]
    away = [1e3 * abs(a - b) for a, b in zip(answer["transform"]["translation"], truth[:3])]
    # Of deviations that six views state, which are themselves uncertain.
    yield all(d < 6 * sd for d, sd in zip(away, answer["sd_mm"])), f"{away} mm away, stated {answer['sd_mm']}"
    yield [known["views"] for known in state["history"]] == [4, 5, 6], f"history: {state['history']}"
    yield from check_page(watch, words=("known to", f"{VIEWS} pictures", "Next pose", "Least known", "<polygon", "picture?"))


def check_troubles(watch, live):
    before = (live / "poses.tum").read_text()
    (live / "poses.tum").write_text(before + "6 nobody knows\n")
    state, _ = watch.wait("broken row", lambda state: says(state, "poses.tum"))
    yield state["answer"]["views"] == VIEWS, "a broken row takes the answer away"
    (live / "poses.tum").write_text(before)
    watch.wait("mended row", lambda state: not state["waiting"])
    (live / "images" / "000.png").unlink()
    state, _ = watch.wait("removed picture", answered(VIEWS - 1))
    yield state["pictures"] == VIEWS - 1 and state["answer"]["not_yet"] == "", f"a removed picture: {state['answer']}"
    (live / "images" / "006.png").write_bytes(b"\x89PNG\r\n\x1a\n no picture at all")
    state, _ = watch.wait("what is no picture", lambda state: says(state, "006.png: not whole yet"))
    yield state["answer"]["views"] == VIEWS - 1, "what is no picture takes the answer away"
    (live / "images" / "006.png").unlink()
    watch.wait("rest", lambda state: not state["waiting"])


def check_refusals(calib, watch, work):
    yield status_of(watch.address + "state", host="example.com") == 403, "another Host is answered"
    yield status_of(watch.address + "state", host=f"localhost:{watch.port}") == 200, "localhost is refused"
    yield status_of(watch.address + "state", method="POST") == 405, "POST is answered"
    yield status_of(watch.address + "nothing") == 404, "a page that is not there"
    with contextlib.closing(socket.socket()) as outside, contextlib.suppress(OSError):
        outside.connect((socket.gethostbyname(socket.gethostname()), watch.port))
        own = outside.getsockname()[0].startswith("127.")
        yield own, f"answers at {outside.getpeername()}"
    cell = work / "cell"
    for arm in ("left", "right"):
        shutil.copytree(work / "full", cell / arm)
    for words, expected in (((work / "live", "--port", watch.port), ["--port", str(watch.port)]),
                            ((work / "nowhere",), ["no such folder"]), ((cell,), ["left, right", "expected one"]),
                            ((work / "live", "--lower", "1,1,1", "--upper", "0,2,2"), ["--lower"])):
        done = program.call(calib, "watch", *words, timeout=PATIENCE)
        one_line = done.stderr.count("\n") == 1 and not done.stdout
        yield done.returncode == 2 and one_line and all(word in done.stderr for word in expected), \
            f"watch {words}: exit code {done.returncode}: {done.stderr}"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--calib", required=True, help="the program flash-calib")
    parser.add_argument("--draw", required=True, help="the program rendered_dataset")
    parser.add_argument("--formats", required=True, type=pathlib.Path, help="docs/formats.md")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        work = pathlib.Path(temporary)
        full, live = work / "full", work / "live"
        program.must(options.draw, full, "eye-in-hand", TARGET, VIEWS, "1280x720", "0.05", "0.5", 3)
        live.mkdir()
        numbers = next(row for row in (full / "truth/X_and_Z.tum").read_text().splitlines() if not row.startswith("#"))
        truth = [float(word) for word in numbers.split()[1:]]
        watch = Watch(options.calib, live)
        try:
            results = list(check_growth(watch, full, live, truth))
            fields = documented.fields_by_schema(options.formats.read_text()).get("flash-watch/1", set())
            missing = sorted(set(documented.unnamed(watch.state(), fields)))
            results.append((not missing, f"{options.formats} does not name {missing}"))
            results += list(check_troubles(watch, live))
            results += list(check_refusals(options.calib, watch, work))
            code, err = watch.ended(signal.SIGINT)
            results.append((code == 0 and not err, f"Ctrl-C: exit code {code}: {err}"))
        finally:
            watch.process.kill()
        watch = Watch(options.calib, live, "--json")
        try:
            state, _ = watch.wait("answer of what was there", answered(VIEWS - 1))
            results.append((state["answer"]["not_yet"] == "", f"started anew: {state['answer']}"))
            code, err = watch.ended(signal.SIGTERM)
            results.append((code == 0 and not err, f"SIGTERM: exit code {code}: {err}"))
        finally:
            watch.process.kill()
    sys.exit(program.conclude(results))


if __name__ == "__main__":
    main()
