#!/usr/bin/env python3
"""Draws runs of `flash-sim bench --device cuda --json` under the roof of their card.

Usage: roofline.py BENCH.json PICTURE.svg
"""
import json
import math
import sys

WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM = 760, 470, 80, 170, 40, 60
COLOURS = ["#1f6fb4", "#d1662f", "#3a8f4d", "#7a4fa3", "#8a8a00"]


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    with open(sys.argv[1], encoding="utf-8") as file:
        bench = json.load(file)
    if "rates" not in bench:
        sys.exit(f"{sys.argv[1]}: found no rates of a card, expected a run with --device cuda")
    with open(sys.argv[2], "w", encoding="utf-8") as file:
        file.write(picture(bench))


def point_of(run):
    """Flops per byte and flops per second of a run, by the least that its counts need."""
    seconds = 1e-3 * run["step_ms"] / (1 if run["alone"] else run["environments"])
    return run["least_flops"] / run["least_bytes"], run["least_flops"] / seconds


def ticks(low, high, digits):
    powers = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    return [digit * 10.0 ** power for power in powers for digit in digits if low <= digit * 10.0 ** power <= high]


def picture(bench):
    bytes_per_second, peak = bench["rates"]["copied_bytes"], bench["rates"]["single_flops"]
    points = [(run, *point_of(run)) for run in bench["runs"]]
    ridge = peak / bytes_per_second
    x_low, x_high = 0.7 * min(x for _, x, _ in points), 2 * ridge
    y_low, y_high = 0.5 * min(y for _, _, y in points), 2 * peak

    def x_at(value):
        return LEFT + (WIDTH - LEFT - RIGHT) * math.log(value / x_low) / math.log(x_high / x_low)

    def y_at(value):
        return HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * math.log(value / y_low) / math.log(y_high / y_low)

    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" '
           'font-family="sans-serif" font-size="13">',
           f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>',
           f'<text x="{LEFT}" y="22" font-size="15">Lifts on one {bench["rates"]["name"]}</text>']
    for low, high, at, is_x in ((x_low, x_high, x_at, True), (y_low, y_high, y_at, False)):
        for value in ticks(low, high, (1, 2, 5) if is_x else (1,)):
            place = at(value)
            if is_x:
                line, text = f'x1="{place:.1f}" x2="{place:.1f}" y1="{TOP}" y2="{HEIGHT - BOTTOM}"', f"{value:g}"
                label = f'x="{place:.1f}" y="{HEIGHT - BOTTOM + 18}" text-anchor="middle"'
            else:
                line, text = f'x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{place:.1f}" y2="{place:.1f}"', f"{value / 1e9:g}"
                label = f'x="{LEFT - 6}" y="{place + 4:.1f}" text-anchor="end"'
            out += [f'<line {line} stroke="#ddd"/>', f"<text {label}>{text}</text>"]
    out += [f'<text x="{(LEFT + WIDTH - RIGHT) / 2}" y="{HEIGHT - 16}" text-anchor="middle">operations per byte</text>',
            f'<text transform="translate(20 {(TOP + HEIGHT - BOTTOM) / 2}) rotate(-90)" text-anchor="middle">'
            "operations per second [10⁹]</text>",
            f'<polyline fill="none" stroke="black" stroke-width="2" points="{x_at(x_low):.1f},'
            f'{y_at(x_low * bytes_per_second):.1f} {x_at(ridge):.1f},{y_at(peak):.1f} {x_at(x_high):.1f},{y_at(peak):.1f}"/>',
            f'<text x="{x_at(ridge) - 8:.1f}" y="{y_at(peak) - 8:.1f}" text-anchor="middle">'
            f"{1e-12 * bytes_per_second:.2f} TB/s, {1e-12 * peak:.0f} TFLOP/s</text>"]
    sizes = sorted({run["vertices"] for run, _, _ in points})
    counts = sorted({run["environments"] for run, _, _ in points})

    def radius(count):
        return 3 + 2.5 * counts.index(count)

    for run, x, y in points:
        colour = COLOURS[sizes.index(run["vertices"]) % len(COLOURS)]
        out.append(f'<circle cx="{x_at(x):.1f}" cy="{y_at(y):.1f}" r="{radius(run["environments"])}" '
                   f'fill="{colour}" fill-opacity="0.35" stroke="{colour}"/>')
    for k, size in enumerate(sizes):
        y = TOP + 20 * k + 10
        out += [f'<circle cx="{WIDTH - RIGHT + 20}" cy="{y}" r="4.5" fill="{COLOURS[k % len(COLOURS)]}"/>',
                f'<text x="{WIDTH - RIGHT + 30}" y="{y + 4}">{size:,} vertices</text>']
    for k, count in enumerate(counts):
        y = TOP + 20 * len(sizes) + 26 * k + 26
        out += [f'<circle cx="{WIDTH - RIGHT + 20}" cy="{y}" r="{radius(count)}" fill="none" stroke="#444"/>',
                f'<text x="{WIDTH - RIGHT + 38}" y="{y + 4}">{count:,} environment{"s" if count > 1 else ""}</text>']
    out.append("</svg>")
    return "\n".join(out) + "\n"


if __name__ == "__main__":
    main()
