"""Pages in headless Chromium (Debian's chromium): what a page logs, what stands in it once its scripts have run, and pictures of it."""
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import tempfile

TRIES, SECONDS = 3, 90
NAMES = ("chromium", "chromium-browser", "google-chrome")
# One profile a call; WebGL by the processor, so that it draws the same where there is no device.
OPTIONS = ("--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-gpu-vsync",
           "--hide-scrollbars", "--disable-dev-shm-usage", "--force-device-scale-factor=1", "--no-first-run", "--disable-extensions", "--lang=en-US",
           "--disable-background-networking", "--virtual-time-budget=20000")
# What software rendering logs by itself.
HARMLESS = ("GPU stall due to ReadPixels", "Automatic fallback to software WebGL", "willReadFrequently")

# Runs in the page after its own scripts. Its result is JSON in an element of its own.
PROBE = r"""
<script>
addEventListener("load", () => setTimeout(() => {
  const shown = e => e.getClientRects().length > 0;
  const flat = v => v && v.length !== undefined && typeof v !== "string" ? Array.from(v, flat) : v;
  const plots = {};
  for (const p of document.querySelectorAll(".js-plotly-plot"))
    plots[p.id] = {shown: shown(p), drawn: p.querySelectorAll("canvas, path").length,
      traces: p.data.map(t => ({type: t.type || "scatter", name: t.name, x: flat(t.x), y: flat(t.y), z: flat(t.z), color: t.marker && t.marker.color})),
      shapes: (p.layout.shapes || []).map(s => ({type: s.type, x0: s.x0, x1: s.x1, fill: s.fillcolor, dash: s.line && s.line.dash}))};
  const result = {
    title: document.title, text: document.body.innerText, plots,
    wide: document.documentElement.scrollWidth - document.documentElement.clientWidth,
    broken: Array.from(document.images).filter(i => shown(i) && !i.naturalWidth).map(i => i.alt || i.src.slice(0, 60)),
    sections: Array.from(document.querySelectorAll("section")).map(s => ({id: s.id, shown: shown(s),
      title: (s.querySelector("h2") || {innerText: ""}).innerText,
      text: Array.from(s.children).filter(c => !c.matches("h2, p.about, .controls")).map(c => c.innerText).join(" ").trim().length,
      drawn: s.querySelectorAll("svg path, svg line, svg rect, canvas, img").length})),
    rows: Object.fromEntries(Array.from(document.querySelectorAll("table[id]")).map(t =>
      [t.id, Array.from(t.rows).map(r => Array.from(r.cells).map(c => c.innerText.trim()))])),
    figures: Array.from(document.querySelectorAll("figure")).map(f => ({caption: (f.querySelector("figcaption") || {innerText: ""}).innerText,
      paths: Array.from(f.querySelectorAll("svg path")).map(p => p.getAttribute("d")).filter(d => d && d.length < 1e5)}))};
  const element = document.createElement("script");
  element.type = "application/json"; element.id = "probe"; element.textContent = JSON.stringify(result).replace(/</g, "\\u003c");
  document.body.append(element);
}, 1500));
</script>
"""


def program():
    """Path of a Chromium, or None."""
    return next((path for path in map(shutil.which, NAMES) if path), None)


def run(page, *options):
    """stdout and stderr; page: a file or an address. Once in some hundred calls Chromium does not come to its end: then it is started anew."""
    address = page if "://" in str(page) else pathlib.Path(page).resolve().as_uri()
    for _ in range(TRIES):
        with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
            words = [program(), *OPTIONS, f"--user-data-dir={profile}", *options, address]
            started = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, errors="replace",
                                       start_new_session=True)
            try:
                out, err = started.communicate(timeout=SECONDS)
            except subprocess.TimeoutExpired:
                os.killpg(started.pid, signal.SIGKILL)  # its own children alone
                started.communicate()
                continue
            if started.returncode == 0:
                return out, err
            raise SystemExit(f"{page}: chromium ends with {started.returncode}: {err[-500:]}")
    raise SystemExit(f"{page}: chromium did not end in {SECONDS} s, {TRIES} times")


def console(err):
    """Lines that a page logged, but for those of software rendering."""
    return [line for line in err.splitlines() if "CONSOLE" in line and not any(word in line for word in HARMLESS)]


def served(address):
    """The elements of a page that a program serves, as they are once its scripts ran for a while, and what it logged."""
    out, err = run(address, "--dump-dom", "--enable-logging=stderr", "--window-size=1280,1000")
    return out, console(err)


def probed(page):
    """What PROBE finds in the page, and "log": lines of its console."""
    with tempfile.TemporaryDirectory() as folder:
        copy = pathlib.Path(folder) / "page.html"
        text = pathlib.Path(page).read_text()
        copy.write_text(text.replace("</body>", PROBE + "</body>"))
        out, err = run(copy, "--dump-dom", "--enable-logging=stderr", "--window-size=1280,1000")
    found = re.search(r'<script type="application/json" id="probe">(.*?)</script>', out, re.DOTALL)
    log = console(err)
    if not found:
        raise SystemExit(f"{page}: its scripts did not come to their end: {log or err[-500:]}")
    return {**json.loads(found[1]), "log": log}


def picture(page, out, width, height, script=""):
    """A picture of the first `height` pixels of the page; `script` runs before, as to scroll or to open a section."""
    if pathlib.Path(page).suffix != ".html":
        run(page, f"--screenshot={pathlib.Path(out).resolve()}", f"--window-size={width},{height}")
        return
    with tempfile.TemporaryDirectory() as folder:
        copy = pathlib.Path(folder) / "page.html"
        late = f"<script>addEventListener('load', () => setTimeout(() => {{ {script} }}, 1000));</script>"
        copy.write_text(pathlib.Path(page).read_text().replace("</body>", late + "</body>"))
        run(copy, f"--screenshot={pathlib.Path(out).resolve()}", f"--window-size={width},{height}")
