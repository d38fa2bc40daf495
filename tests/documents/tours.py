#!/usr/bin/env python3
"""Runs the commands of pages, block by block, as a reader does who goes from page to page. Each prints what stands in the ```text
below it, numbers to a tenth, and ends with 0, or with the exit code that the text behind it names. The seconds of each are told."""
import argparse
import json
import os
import pathlib
import re
import resource
import shutil
import subprocess
import sys
import time
import urllib.request

import browser
import commands

NUMBER = re.compile(r"[-+]?\d[\d,]*(?:\.\d+)?(?:e[-+]?\d+)?")
# Pictures of the pages: the file that is shown, the size of the window [px], and the one section that is kept of it.
ONLY = "for (const e of document.querySelectorAll('main > *')) if (e.id !== '{}') e.remove();".format
PICTURES = {
    "calibrate_a_cell.md": {
        "handeye_report.png": ("demo/cell/wrist.html", 1180, 880, ""),
        "cell_arrows.png": ("demo/cell/wrist.html", 1180, 670, ONLY("residual-section")),
        "cell_size.png": ("demo/cell/size.html", 1180, 560, ""),
        "cell_slip.png": ("demo/cell/slip.html", 1180, 500, ONLY("pictures-section")),
        "cell_knock.png": ("demo/cell/knock.html", 1180, 560, ""),
        "watch.png": ("flash-calib watch demo/cell/growing", 1180, 1210, ""),
    },
    "identify_a_towel.md": {
        "towel_segment.png": ("demo/segmented/segment.svg", 1856, 723, ""),
        "towel_armless.png": ("demo/armless/segment.svg", 1856, 723, ""),
        "towel_fast.png": ("demo/fast/segment.svg", 1856, 723, ""),
        "towel_import.png": ("demo/lift/import.svg", 698, 899, ""),
        "report.png": ("demo/run/report.html", 1180, 700, ""),
        "towel_profiles.png": ("demo/run/report.html", 1180, 480, ONLY("profile-section")),
        "towel_place.png": ("demo/place/report.html", 1180, 620, ""),
        "towel_low.png": ("demo/low/report.html", 1180, 620, ""),
        "towel_small.png": ("demo/small/report.html", 1180, 620, ""),
        "towel_replay.png": ("demo/check/sequence.png", 0, 0, ""),
    },
}


def prepare(out):
    """The folder in which the commands are run, with examples/ of the checkout."""
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    (out / "examples").symlink_to(commands.ROOT / "examples")


def same_numbers(said, found):
    """To a tenth, or two units of the last digit that is stated."""
    for a, b in zip(NUMBER.findall(said), NUMBER.findall(found)):
        x, y = float(a.replace(",", "")), float(b.replace(",", ""))
        last = 10.0 ** -len(re.sub(r"^[^.]*\.?|e.*$", "", a))
        if abs(x - y) > 0.1 * abs(x) + 2 * last:
            return False
    return True


def prints(said, found):
    """Whether the line is as it is said; a line that ends with ... is cut there."""
    start = said.removesuffix("...").rstrip()
    shape = NUMBER.sub("#", start)
    found_shape = NUMBER.sub("#", found.rstrip())
    fits = found_shape.startswith(shape) if said.endswith("...") else found_shape == shape
    return fits and same_numbers(start, found)


def missing(said, found):
    """Lines of a ```text block that are not printed in their order; a line of dots stands for any."""
    lines, k = [line.rstrip() for line in found.splitlines()], 0
    for line in (line for line in said if line.strip() not in ("", "...")):
        at = next((i for i in range(k, len(lines)) if prints(line.rstrip(), lines[i])), None)
        if at is None:
            yield line
        else:
            k = at + 1


def run(page, out, path, seconds):
    """Complaints about the page; the seconds that each block takes are added to those before."""
    found = commands.blocks((commands.ROOT / "docs" / page).read_text())
    after = [prose for _, _, prose in found[1:]] + [""]
    count = 0
    for k, (language, lines, _) in enumerate(found):
        if language != commands.RUN:
            continue
        count += 1
        script, begun = "\n".join(lines), time.monotonic()
        done = subprocess.run(["bash", "-e", "-c", script], cwd=out, text=True, errors="replace", stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, env={**os.environ, "PATH": f"{path}:{os.environ['PATH']}"})
        seconds.append(time.monotonic() - begun)
        print(f"{seconds[-1]:7.1f} s  {page}: {lines[0].removesuffix(chr(92)).rstrip()}", flush=True)
        shown = k + 1 < len(found) and found[k + 1][0] == "text"
        prose = after[k] + (after[k + 1] if shown else "")
        codes = [int(code) for code in re.findall(r"exit code (?:is )?(\d)", prose)]
        if done.returncode not in (codes or [0]):
            yield f"{page}: {script}\nends with {done.returncode}, the page says {codes or 0}:\n{done.stdout}"
        if shown and (lacking := list(missing(found[k + 1][1], done.stdout))):
            yield f"{page}: {script}\ndoes not print:\n" + "\n".join(lacking) + f"\nbut:\n{done.stdout}"
    if not count:
        yield f"{page}: no block ```{commands.RUN}"


def draw_watch(words, out, path, picture, size):
    """The page that the words serve, once it has answered: the first eight pictures of examples/handeye/wrist."""
    growing = out / words[-1]
    shutil.copytree(out / "examples/handeye/wrist", growing,
                    ignore=lambda _, names: [n for n in names if n > "007.jpg" and n.endswith(".jpg")])
    with subprocess.Popen([path / words[0], *words[1:], "--port", "0"], cwd=out, stdout=subprocess.PIPE, text=True) as served:
        address = re.search(r"http://\S+/", served.stdout.readline())[0]
        state = {}
        while not state or state["looking"] or state["solving"] or not state["answer"]:
            time.sleep(0.2)
            with urllib.request.urlopen(address + "state") as reply:
                state = json.load(reply)["state"]
        browser.picture(address, picture, *size)
        served.terminate()


def draw_pictures(page, out, images, path):
    for name, (shown, width, height, script) in PICTURES.get(page, {}).items():
        if shown.startswith("flash-calib watch "):
            draw_watch(shown.split(), out, path, images / name, (width, height))
        elif shown.endswith(".png"):
            shutil.copyfile(out / shown, images / name)
        else:
            browser.picture(out / shown, images / name, width, height, script)
        print(images / name)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("pages", nargs="+", help="of docs/, with blocks ```sh")
    parser.add_argument("--bin", required=True, type=pathlib.Path, help="the folder of the programs")
    parser.add_argument("--out", required=True, type=pathlib.Path)
    parser.add_argument("--images", type=pathlib.Path, help="draw the pictures of the pages into this folder")
    options = parser.parse_args()
    out = options.out.resolve()
    prepare(out)
    wrong, seconds = [], []
    for page in options.pages:
        wrong += run(page, out, options.bin.resolve(), seconds)
    used = resource.getrusage(resource.RUSAGE_CHILDREN)  # where others compute too, it takes longer than this says
    print(f"{sum(seconds):7.1f} s, {sum(seconds) / 60:.1f} minutes, for {len(seconds)} blocks of commands on {os.cpu_count()} cores, which worked "
          f"{used.ru_utime + used.ru_stime:.0f} s for them")
    if wrong:
        sys.exit("\n\n".join(wrong))
    for page in options.pages if options.images else []:
        draw_pictures(page, out, options.images, options.bin.resolve())
    print(f"{', '.join(options.pages)}: every command does what the page says")


if __name__ == "__main__":
    main()
