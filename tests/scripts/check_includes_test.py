#!/usr/bin/env python3
"""Trees whose includes go one way pass; arrows against the order, cycles and folders without a place are named."""
import importlib.machinery
import importlib.util
import pathlib
import tempfile

PATH = pathlib.Path(__file__).resolve().parents[2] / "scripts" / "check_includes"
loader = importlib.machinery.SourceFileLoader("check_includes", str(PATH))
check_includes = importlib.util.module_from_spec(importlib.util.spec_from_loader("check_includes", loader))
loader.exec_module(check_includes)

ORDER = """
data <- solver <- apps
solver/law <- solver/step
"""
GOOD = {
    "data/mesh.h": "",
    "solver/law/spring.h": '#include "data/mesh.h"\n#include <vector>\n',
    "solver/step/euler.h": '#include "solver/law/spring.h"\n#include "solver/step/step.h"\n',
    "solver/step/step.h": '#include "data/mesh.h"\n',
    "apps/run.cpp": '#include "elsewhere.h"\n  #include "solver/step/euler.h"\n#include "data/mesh.h"\n',
    "tests/mesh_test.cpp": '#include "apps/run.cpp"\n',
}


def faults(**changed):
    """Of the good tree with these files changed, by name with _ for / and the ending .h."""
    files = GOOD | {name.replace("_", "/") + ".h": text for name, text in changed.items()}
    with tempfile.TemporaryDirectory() as folder:
        for name, text in files.items():
            path = pathlib.Path(folder) / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
        return check_includes.faults(folder, ORDER)


assert faults() == [], faults()

against = faults(data_mesh='\n#include "apps/options.h"\n', apps_options="")
assert "data/mesh.h:2: #include \"apps/options.h\": data may not include apps" in against, against
assert "check_includes: a cycle: apps -> data -> apps" in against, against
assert "  data/mesh.h:2: #include \"apps/options.h\"" in against, against

cycle = faults(solver_law_spring='#include "solver/step/step.h"\n')
assert "solver/law/spring.h:1: #include \"solver/step/step.h\": solver/law may not include solver/step" in cycle, cycle
assert "check_includes: a cycle: solver/law -> solver/step -> solver/law" in cycle, cycle
assert sum("euler.h:1" in line for line in cycle) == 1, cycle

beside = faults(solver_law_spring='#include "../step/step.h"\n')
assert any("solver/law may not include solver/step" in line for line in beside), beside

undeclared = faults(solver_other_new='#include "solver/law/spring.h"\n')
assert undeclared == ['solver/other/new.h:1: #include "solver/law/spring.h": solver/other may not include solver/law']

declared = check_includes.faults(PATH.parent, "a <- b <- a")
assert declared == ["check_includes: the declared order is a cycle: a <- b <- a"], declared
