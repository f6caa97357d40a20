"""The arrows and sizes of docs/architecture.md, held by reading the source without importing."""

import ast
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "rigid"
DOCUMENT = PACKAGE.parent / "docs" / "architecture.md"

# A room may import only rooms of the lines above its own, and itself.
LAYERS = (
    ("io", "kinds", "plots"),
    ("effects", "jobs", "spec"),
    ("physics", "records"),
    ("likelihood",),
    ("inference",),
    ("localfit",),
    ("discovery", "friction", "smoothing", "planning", "published", "validation"),
    ("report",),
    ("study",),
    (
        "bands",
        "batch",
        "check",
        "compare",
        "discover",
        "fit",
        "laws",
        "new",
        "paper",
        "plan",
        "validate",
        "__main__",
    ),
)
LAYER = {room: number for number, rooms in enumerate(LAYERS) for room in rooms}
FLOORS, ROOMS = 10, 25
"""At most; the commands and the face, in the root, are one room."""

# The same inside a room that has rooms of its own.
WITHIN = {
    "localfit": (
        ("candidates", "evidence", "hidden_inputs", "one_of", "screening"),
        ("families", "hypothesis"),
        ("samples",),
        ("local",),
        ("motions",),
        ("expansion", "integral", "reference_check", "settled", "signature", "trust_region"),
        ("noise", "where"),
        ("ascent",),
        ("leave_one_out",),
        ("scatter",),
    ),
    "discovery": (
        ("base_fit", "fitted", "near"),
        ("unmodelled",),
        ("weighing",),
        ("disagreement", "refit"),
        ("form", "periodic"),
        ("pickup",),
        ("signatures",),
        ("turn",),
        ("outcome", "rivals"),
        ("workflow",),
    ),
    "report": (
        ("noise_found", "paper_values", "taken", "usability"),
        ("content",),
        ("wording",),
        ("templating",),
        ("page", "gallery", "made"),
        ("section",),
        ("calibration", "discovery", "laws", "bands", "published", "season", "plan", "validation"),
        ("compare", "paper", "parted"),
    ),
}

PHYSICS = {"effects", "physics"}
NOT_FOR_PHYSICS = {"records", "spec", "likelihood"}
STATISTICS = {"inference"} | {
    f"likelihood/{name}.py"
    for name in ("noise", "priors", "quantisation", "correlation", "parameters", "channels")
}
PICTURES = {"plots", "report"}
COMPUTING = {"jax", "jaxlib", "equinox", "diffrax", "optimistix", "lineax", "emcee"}
UNSAFE_MODULES = {"pickle", "marshal", "shelve", "dill", "cloudpickle"}
LONGEST_MODULE, LONGEST_FUNCTION, MOST_PARAMETERS = 400, 60, 8


def room_of(path: Path, package: Path) -> str:
    return path.relative_to(package).parts[0].removesuffix(".py")


def dotted_imports(tree: ast.AST, path: Path, package: Path) -> Iterator[tuple[int, str]]:
    """(line, absolute dotted name) of whatever a module imports, relative imports resolved."""
    here = [package.name, *path.relative_to(package).parts[:-1]]
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = here[: len(here) - node.level + 1] if node.level else []
            base = ".".join([*above, *([node.module] if node.module else [])])
            yield from ((node.lineno, f"{base}.{alias.name}") for alias in node.names)


def rooms_imported(tree: ast.AST, path: Path, package: Path) -> Iterator[tuple[int, str]]:
    for line, name in dotted_imports(tree, path, package):
        parts = name.split(".")
        if parts[0] == package.name and len(parts) > 1:
            yield line, parts[1]


def arrows(tree: ast.AST, path: Path, package: Path) -> Iterator[str]:
    room = room_of(path, package)
    if room not in LAYER:
        if room not in {"__init__", "generator"}:
            yield "1: this room has no layer; give it one here and its line in docs/architecture.md"
        return
    for line, other in rooms_imported(tree, path, package):
        if other == "generator":
            yield f"{line}: imports the generator, which nothing may import"
        elif other not in LAYER:
            yield f"{line}: {room} imports {package.name}.{other}, a name of the package's face"
        elif room in PHYSICS and other in NOT_FOR_PHYSICS:
            yield f"{line}: physics ({room}) imports {other}"
        elif other != room and other in LAYER and LAYER[other] >= LAYER[room]:
            yield f"{line}: {room} imports {other}, against the arrows"


def arrows_within(tree: ast.AST, path: Path, package: Path) -> Iterator[str]:
    """The arrows inside a room of rooms; its face, `__init__`, imports nothing."""
    parts = path.relative_to(package).parts
    if parts[0] not in WITHIN:
        return
    layer = {room: n for n, rooms in enumerate(WITHIN[parts[0]]) for room in rooms}
    mine = parts[1].removesuffix(".py")
    if mine not in layer:
        if mine != "__init__":
            yield f"1: {parts[0]}/{mine} has no layer; give it one here"
        return
    for line, name in dotted_imports(tree, path, package):
        inside = name.split(".")[1:]
        if len(inside) > 1 and inside[0] == parts[0]:
            other = inside[1]
            if other != mine and other in layer and layer[other] >= layer[mine]:
                yield f"{line}: {mine} imports {other}, against the arrows within {parts[0]}"


def generator_alone(tree: ast.AST, path: Path, package: Path) -> Iterator[str]:
    if room_of(path, package) == "generator":
        for line, other in rooms_imported(tree, path, package):
            if other != "generator":
                yield f"{line}: the generator imports {package.name}.{other}"


def pictures_compute_nothing(tree: ast.AST, path: Path, package: Path) -> Iterator[str]:
    room = room_of(path, package)
    if room in PICTURES:
        for line, name in dotted_imports(tree, path, package):
            if name.split(".")[0] in COMPUTING:
                yield f"{line}: {room} imports {name}"


def sizes(tree: ast.AST, path: Path, package: Path) -> Iterator[str]:
    length = len(path.read_text("utf-8").splitlines())
    if length > LONGEST_MODULE:
        yield f"1: {length} lines, allowed {LONGEST_MODULE}"
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            lines = (node.end_lineno or node.lineno) - node.lineno + 1
            if lines > LONGEST_FUNCTION:
                yield f"{node.lineno}: {node.name} has {lines} lines, allowed {LONGEST_FUNCTION}"
            count = len(parameters(node.args))
            if count > MOST_PARAMETERS:
                yield f"{node.lineno}: {node.name}: {count} parameters, allowed {MOST_PARAMETERS}"


def parameters(arguments: ast.arguments) -> list[str]:
    extra = [a for a in (arguments.vararg, arguments.kwarg) if a]
    named = [*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs, *extra]
    return [a.arg for a in named if a.arg not in {"self", "cls"}]


def unsafe(tree: ast.AST, path: Path, package: Path) -> Iterator[str]:
    for line, name in dotted_imports(tree, path, package):
        if name.split(".")[0] in UNSAFE_MODULES:
            yield f"{line}: imports {name}"
    for node in ast.walk(tree):
        if not isinstance(node, ast.Call):
            continue
        if isinstance(node.func, ast.Name) and node.func.id in {"eval", "exec"}:
            yield f"{node.lineno}: calls {node.func.id}"
        for keyword in node.keywords:
            if keyword.arg == "allow_pickle" and getattr(keyword.value, "value", True):
                yield f"{node.lineno}: reads pickles"


def light_package(tree: ast.AST, path: Path, package: Path) -> Iterator[str]:
    if path == package / "__init__.py":
        for line, name in dotted_imports(tree, path, package):
            if name.split(".")[0] not in {package.name, *sys.stdlib_module_names}:
                yield f"{line}: {package.name}/__init__ imports {name}; it must stay light"


def statistics_name_no_effect(tree: ast.AST, path: Path, package: Path) -> Iterator[str]:
    if not STATISTICS & {room_of(path, package), path.relative_to(package).as_posix()}:
        return
    stems = {p.stem for p in (package / "effects").glob("*.py")} - {
        "__init__",
        "__main__",
        "base",
        "declare",
        "placed",
    }
    for number, text in enumerate(path.read_text("utf-8").splitlines(), start=1):
        letters = re.sub(r"[-_]", "", text).lower()
        for stem in sorted(stems):
            if stem.replace("_", "") in letters:
                yield f"{number}: statistics name the effect {stem}"


READING = {"split", "rsplit", "partition", "rpartition", "startswith", "endswith", "strip",
           "rstrip", "lstrip", "removeprefix", "removesuffix", "find", "index"}  # fmt: skip
HEADER = "["
"""What a table of TOML starts with, and no label does."""


def labels_are_not_read(tree: ast.AST, path: Path, package: Path) -> Iterator[str]:
    """A parameter says what it belongs to; nobody takes the brackets of its label apart."""
    if room_of(path, package) in {"io", "spec", "records", "plots"}:  # TOML, units, TeX have, too
        return
    for node in ast.walk(tree):
        if (
            isinstance(node, ast.Call)
            and isinstance(node.func, ast.Attribute)
            and node.func.attr in READING
            and any(set("[]") & set(text) for text in _texts(node.args))
            and not (node.func.attr == "startswith" and list(_texts(node.args)) == [HEADER])
        ):
            yield f"{node.lineno}: reads a label with {node.func.attr}; ask the Parameter"


def _texts(arguments: list[ast.expr]) -> Iterator[str]:
    for one in arguments:
        for node in ast.walk(one):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                yield node.value


CHECKS = (
    arrows,
    arrows_within,
    generator_alone,
    pictures_compute_nothing,
    sizes,
    unsafe,
    light_package,
    statistics_name_no_effect,
    labels_are_not_read,
)


def violations(package: Path) -> list[str]:
    found = []
    for path in sorted(package.rglob("*.py")):
        tree = ast.parse(path.read_text("utf-8"), str(path))
        for check in CHECKS:
            where = path.relative_to(package.parent).as_posix()
            found += [f"{where}:{message}" for message in check(tree, path, package)]
    return found


def test_package_keeps_to_its_architecture():
    found = violations(PACKAGE)
    assert not found, "\n" + "\n".join(found)


def test_the_house_has_few_floors_and_rooms_and_no_circle():
    assert len(LAYERS) <= FLOORS
    folders = {room_of(path, PACKAGE) for path in PACKAGE.rglob("*/*.py")}
    assert len(folders) + 1 <= ROOMS  # and the root
    assert not circles(PACKAGE)


def circles(package: Path) -> list[str]:
    """Modules that import each other in a loop, at whatever time they do it."""
    homes = {
        ".".join(p.relative_to(package.parent).with_suffix("").parts): p
        for p in package.rglob("*.py")
        if p != package / "__init__.py"
    }
    left = {}
    for name, path in homes.items():
        asked = dotted_imports(ast.parse(path.read_text("utf-8")), path, package)
        named = {end for _, dotted in asked for end in (dotted, dotted.rpartition(".")[0])}
        left[name] = named & homes.keys() - {name}
    while free := {name for name, needs in left.items() if not needs & left.keys()}:
        left = {name: needs for name, needs in left.items() if name not in free}
    return sorted(left)


def test_every_room_stands_in_the_document():
    rooms = {room_of(path, PACKAGE) for path in PACKAGE.rglob("*.py")} - {"__init__"}
    named = set(re.findall(r"\b(\w+)(?:\.py|/)", DOCUMENT.read_text("utf-8")))
    assert not rooms - named, f"not in docs/architecture.md: {sorted(rooms - named)}"


def test_importing_the_package_loads_nothing_heavy():
    program = "import sys, rigid; print(*sorted(m.split('.')[0] for m in sys.modules))"
    run = subprocess.run(
        [sys.executable, "-c", program],
        capture_output=True,
        text=True,
        check=True,
        cwd=PACKAGE.parent,
    )
    assert not {"jax", "numpy", "scipy", "matplotlib", "pydantic"} & set(run.stdout.split())


LONG_FUNCTION = "def f():\n" + "    x = 1\n" * 60
BROKEN = {
    "an arrow the wrong way": (
        "physics/rig.py",
        "from rigid.inference import search",
        "against the arrows",
    ),
    "a relative arrow": ("effects/drag.py", "from ..physics.rig import Rig", "against the arrows"),
    "an inner arrow": (
        "discovery/weighing/odds.py",
        "from rigid.discovery.workflow import Outcome",
        "within discovery",
    ),
    "an inner room": ("discovery/odds.py", "", "no layer"),
    "a late import": (
        "records/read.py",
        "def f():\n    from rigid import inference",
        "against the arrows",
    ),
    "physics that reads": ("physics/full.py", "import rigid.records.csv", "physics (physics)"),
    "a leak from the generator": (
        "likelihood/problem.py",
        "from rigid import generator",
        "nothing may",
    ),
    "a generator that borrows": (
        "generator/a.py",
        "from rigid.physics.rig import Rig",
        "the generator",
    ),
    "statistics that know": ("likelihood/priors.py", "X = 'viscous-friction'", "name the effect"),
    "a class that knows": ("inference/moves.py", "ViscousFriction = 1", "name the effect"),
    "a plot that computes": ("plots/a.py", "import jax.numpy as jnp", "plots imports jax"),
    "a long module": ("inference/search.py", "x = 1\n" * 401, "401 lines"),
    "a long function": ("inference/search.py", LONG_FUNCTION, "f has 61 lines"),
    "a wide function": (
        "inference/search.py",
        "def f(a, b, c, *d, e, g, h, i, **j): ...",
        "9 parameters",
    ),
    "eval": ("spec/read.py", "eval('1')", "calls eval"),
    "pickle": ("inference/checkpoint.py", "from pickle import load", "imports pickle"),
    "hidden pickle": ("inference/posterior.py", "np.load('x', allow_pickle=True)", "reads pickles"),
    "a heavy package": ("__init__.py", "import numpy", "must stay light"),
    "a room of its own": ("utils.py", "", "no layer"),
    "a name of the face": ("io/cli.py", "from rigid import load", "the package's face"),
    "a label taken apart": ("likelihood/a.py", "x = label.split('[')[0]", "ask the Parameter"),
}


@pytest.mark.parametrize("case", BROKEN)
def test_the_test_sees(case: str, tmp_path: Path):
    name, source, says = BROKEN[case]
    package = tmp_path / "rigid"
    for file, text in {"effects/viscous_friction.py": "", name: source}.items():
        (package / file).parent.mkdir(parents=True, exist_ok=True)
        (package / file).write_text(text, "utf-8")
    found = violations(package)
    assert len(found) == 1, found
    assert says in found[0]


def test_the_test_sees_a_circle(tmp_path: Path):
    package = tmp_path / "rigid"
    (package / "study").mkdir(parents=True)
    (package / "study" / "fit.py").write_text("def f():\n    from rigid.study.study import Study")
    (package / "study" / "study.py").write_text("from rigid.study import fit")
    assert circles(package) == ["rigid.study.fit", "rigid.study.study"]


def test_an_empty_package_passes(tmp_path: Path):
    assert violations(tmp_path / "rigid") == []
