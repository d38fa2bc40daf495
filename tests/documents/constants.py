#!/usr/bin/env python3
"""The table of constants of the estimator in docs/experiments.md: each constexpr number of sysid/ that is part of an answer, with what
its comment says of it. A comment ends with where the number comes from and why: "Theory: ...", "Measured: ..." or "Chosen: ...". What moves
no answer, but work, memory or a refusal, has "Work". Prints the table; --check says where the document differs, --write puts it there."""
import argparse
import collections
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
DOCUMENT = ROOT / "docs/experiments.md"
BEGIN, END = "<!-- constants -->", "<!-- end of constants -->"
ORIGINS = ("Theory", "Measured", "Chosen", "Work")
# Concepts, and the sources that they stand in. A source with a constant stands in one of them.
CONCEPTS = {
    "On which several steps agree": ["infer/agreed_numbers"],
    "Likelihood: noise, discrepancy, weight of rows": [
        "infer/discrepancy", "infer/discrepancy_prior", "infer/expected_information", "infer/marker_fit", "infer/motion_likelihood",
        "infer/observed_rows", "infer/residual_likelihood", "infer/sheet_modes"],
    "What is held without a measurement": ["infer/estimate_errors", "infer/held", "infer/recentre", "infer/weight_scale", "replay/replay"],
    "Cells, steps, and what settles on them": [
        "infer/settle", "infer/solution_errors", "emulate/mesh_projection", "replay/coarse_cells", "replay/grasp_mesh",
        "replay/half_cell"],
    "Lattices about the answer": ["infer/adaptive_design", "infer/answer", "infer/lattice_about", "emulate/focused_axes",
                                  "emulate/sensitivity", "emulate/tensor_spline"],
    "Posterior and its draws": [
        "infer/bent_student", "infer/ensemble_sampler", "infer/importance_sampling", "infer/log_density_surrogate", "infer/posterior",
        "infer/sampled_look", "infer/scrambled_halton", "infer/surrogate_sampling"],
    "Verdicts, recordings against each other, predictions": [
        "infer/agreement", "infer/prediction", "infer/recordings_alone", "infer/verdict", "emulate/search_warnings"],
    "Plans": ["design/plan", "design/rank_experiments", "design/virtual_experiment"],
    "Replay, observation, time and memory": [
        "infer/expected_work", "infer/time_left", "emulate/candidate_lines", "emulate/fingerprint", "emulate/parameter",
        "emulate/parameter_grid", "emulate/results_table", "emulate/search_memory", "observe/registration", "observe/repeatability",
        "replay/mark", "replay/memory_estimate", "replay/motion", "replay/motion_store", "replay/recorded_mesh", "replay/shard",
        "replay/surface_distance", "replay/surface_tree"],
}
FOLDERS = ("infer", "emulate", "design", "observe", "replay")
NUMBER = r"(?:int|double|float|bool|unsigned|std::(?:size_t|u?int\d+_t|ptrdiff_t)|(?:Eigen::)?Index|std::array<.*>)"
DECLARED = re.compile(rf"^\s*(?:inline |static )*constexpr {NUMBER}\s+(\w+(?:\[\])?\s*=.*)$")
NO_NUMBERS = ("numeric_limits<double>::quiet_NaN", "numeric_limits<double>::infinity", "const char*")

Constant = collections.namedtuple("Constant", "source names values text origin why")


def split(text):
    """At the commas that stand in no brackets."""
    parts, depth = [""], 0
    for letter in text:
        depth += (letter in "({[<") - (letter in ")}]>")
        if letter == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += letter
    return [part.strip() for part in parts]


def comment_of(lines, first, last):
    """Behind the statement, or in the lines above it."""
    behind = re.sub(r"^.*?;\s*", "", lines[last])
    if behind.startswith("//"):
        return behind.lstrip("/< ")
    above = []
    while first > 0 and re.match(r"\s*//", lines[first - 1]):
        first -= 1
        above.insert(0, lines[first].strip().lstrip("/< "))
    return " ".join(above)


def constants_of(path):
    """The constants of a source, and complaints about their comments."""
    found, wrong = [], []
    source = path.relative_to(ROOT / "sysid").as_posix()
    lines = path.read_text().splitlines()
    for first, line in enumerate(lines):
        last = first
        while "constexpr" in line and ";" not in lines[last] and last + 1 < len(lines):
            last += 1
            line += " " + lines[last].strip()
        match = DECLARED.match(re.sub(r"//.*", "", line).split(";")[0])
        if not match or any(word in line for word in NO_NUMBERS):
            continue
        names, values = zip(*(re.split(r"\s*=\s*", part, maxsplit=1) for part in split(match[1])))
        comment = comment_of(lines, first, last)
        parts = re.match(rf"(.*?)\s*\b({'|'.join(ORIGINS)})(?:: (.*)|\.)$", comment)
        if not parts or (parts[2] != "Work" and not parts[1]):
            wrong.append(f"sysid/{source}:{first + 1}: {', '.join(names)}: its comment says not what it is and where it comes from, "
                         f"as {', '.join(ORIGINS[:-1])} or {ORIGINS[-1]}: \"{comment}\"")
            continue
        found.append(Constant(source, [name.removesuffix("[]") for name in names], values, parts[1], parts[2], parts[3] or ""))
    return found, wrong


def written(constant):
    """Its names and its values."""
    return ", ".join(f"`{name}`" for name in constant.names), ", ".join(
        re.sub(r"\b\w+::|'", "", value).replace("|", "\\|") for value in constant.values)


def sentence(text):
    return text[:1].upper() + text[1:]


def table_of(constants):
    """Lines of the document: a table a concept, and below it what is work alone."""
    counts = collections.Counter(constant.origin for constant in constants)
    numbers = collections.Counter()
    for constant in constants:
        numbers[constant.origin] += len(constant.names)
    moving = sum(numbers[origin] for origin in ORIGINS[:-1])
    yield (f"{sum(numbers.values())} constants: {moving} move answers, of which {numbers['Theory']} come from theory, {numbers['Measured']} were "
           f"measured and {numbers['Chosen']} were chosen. {numbers['Work']} are of work alone.")
    assert sum(counts.values()) == len(constants)
    for concept, sources in CONCEPTS.items():
        of_concept = [constant for source in sources for constant in constants if constant.source.rsplit(".", 1)[0] == source]
        answers = [constant for constant in of_concept if constant.origin != "Work"]
        work = [constant for constant in of_concept if constant.origin == "Work"]
        if not of_concept:
            continue
        yield from ("", f"**{concept}**", "")
        if answers:
            yield from ("| constant | value | unit | what it is | from | why | file |", "|---|---|---|---|---|---|---|")
        for constant in answers:
            unit = re.search(r"\s*\[([^\]]*)\]", constant.text)
            text = constant.text.replace(unit[0], "") if unit else constant.text
            row = (*written(constant), unit[1] if unit else "", text.rstrip("."), constant.origin.lower(),
                   sentence(constant.why.rstrip(".")), constant.source)
            yield "| " + " | ".join(row) + " |"
        if work:
            texts = collections.defaultdict(list)
            for constant in work:
                texts[constant.source].append(" ".join(written(constant)))
            yield from ("", "Of work alone: " + "; ".join(f"{source} {', '.join(of)}" for source, of in texts.items()) + ".")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true", help="say where docs/experiments.md differs")
    parser.add_argument("--write", action="store_true", help="put the table into docs/experiments.md")
    options = parser.parse_args()
    constants, wrong = [], []
    for folder in FOLDERS:
        for path in sorted((ROOT / "sysid" / folder).glob("*.[ch]*")):
            found, complaints = constants_of(path)
            constants += found
            wrong += complaints
    known = {source for sources in CONCEPTS.values() for source in sources}
    wrong += [f"sysid/{source}: stands in no concept of {pathlib.Path(__file__).name}"
              for source in sorted({constant.source for constant in constants}) if source.rsplit(".", 1)[0] not in known]
    if wrong:
        sys.exit("\n".join(wrong))
    table = [BEGIN, "", *table_of(constants), "", END]
    text = DOCUMENT.read_text().splitlines()
    if not (options.check or options.write):
        print("\n".join(table))
        return
    if text.count(BEGIN) != 1 or text.count(END) != 1:
        sys.exit(f"{DOCUMENT.name}: found not one table between {BEGIN} and {END}")
    first, last = text.index(BEGIN), text.index(END)
    if options.write:
        DOCUMENT.write_text("\n".join([*text[:first], *table, *text[last + 1:]]) + "\n")
    elif text[first:last + 1] != table:
        there, here = set(text[first:last + 1]), set(table)
        differ = [f"- {line}" for line in text[first:last + 1] if line not in here] + [f"+ {line}" for line in table if line not in there]
        sys.exit("\n".join([f"{DOCUMENT.relative_to(ROOT)} is not what the sources say; `make constants` renews it:", *differ[:20]]))
    else:
        print(f"{sum(len(constant.names) for constant in constants)} constants stand in {DOCUMENT.relative_to(ROOT)} as in the sources")


if __name__ == "__main__":
    main()
