#!/usr/bin/env python3
"""Opens reports in headless Chromium: nothing goes wrong in their scripts, each section has content, and words, tables and
pictures have the numbers of the JSON beside them. Skips where there is no Chromium."""
import argparse
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "robustness"))
import browser
import program
import report_pages


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cameras", type=pathlib.Path, help="a folder with reports of flash-calib handeye, NAME.html beside NAME.json")
    parser.add_argument("--search", type=pathlib.Path, help="a folder of a search, with report.html")
    options = parser.parse_args()
    if not browser.program():
        print("skipped: found no chromium, apt-get install chromium")
        return 0
    results = []
    for page in sorted(options.cameras.glob("*.html")) if options.cameras else []:
        results += report_pages.of_camera(page)
    if options.search:
        results += report_pages.of_search(options.search / "report.html")
    if len(results) < 20:
        sys.exit(f"found {len(results)} statements: reports are missing")
    return program.conclude(results)


if __name__ == "__main__":
    sys.exit(main())
