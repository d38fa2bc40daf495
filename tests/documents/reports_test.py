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


def statements(of_report, page):
    """What holds or does not; a page that lacks what is looked at does not hold."""
    found = []
    try:
        for statement in of_report(page):
            found.append(statement)
    except (LookupError, TypeError) as error:
        found.append((False, f"{page}: lacks what it has to show: {type(error).__name__} {error}"))
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cameras", type=pathlib.Path, help="a folder with reports of flash-calib handeye, NAME.html beside NAME.json")
    parser.add_argument("--searches", type=pathlib.Path, help="a folder with those of searches, each with report.html")
    options = parser.parse_args()
    if not browser.program():
        print("skipped: found no chromium, apt-get install chromium")
        return 0
    results = []
    for page in sorted(options.cameras.glob("*.html")) if options.cameras else []:
        results += statements(report_pages.of_camera, page)
    for page in sorted(options.searches.glob("*/report.html")) if options.searches else []:
        results += statements(report_pages.of_search, page)
    if len(results) < 20:
        sys.exit(f"found {len(results)} statements: reports are missing")
    return program.conclude(results)


if __name__ == "__main__":
    sys.exit(main())
