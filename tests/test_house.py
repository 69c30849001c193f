"""Claim: the house is built as CONTRIBUTING says: layers, homes of libraries, sizes, no banned calls, docstrings."""

from __future__ import annotations

import ast
import json
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from pathlib import Path

import pytest

from tests.patience import PATIENCE

ROOT = Path(__file__).parent.parent
PACKAGE = ROOT / "src" / "plastica"

LAYERS = (
    {"doors"},
    {"show"},
    {"study"},
    {"charts"},
    {"motion"},
    {"equilibria"},
    {"physics"},
    {"material", "numerics"},
    {"units", "files"},
    {"locks"},
    {"errors", "_version"},
)
"""From left to right; a layer imports itself and what stands further right. Those of one row never meet."""

RANK = {name: rank for rank, row in enumerate(LAYERS) for name in row}
TOP = ("__init__", "__main__")
"""The package's own front; it names the public nouns of every layer."""

HOMES = {
    "sympy": {"material"},
    "pint": {"units"},
    "filelock": {"locks"},
    "pydantic": {"study"},
    "pydantic_core": {"study"},
    "matplotlib": {"show"},
    "PIL": {"show"},
    "jinja2": {"show"},
    "click": {"doors"},
    "rich": {"doors"},
    "h5py": {"motion"},
    "h5netcdf": {"motion"},
    "zarr": {"study"},
    "xarray": {"equilibria", "motion", "charts", "study", "show"},
    "array_api_compat": {"numerics"},
    "numba": {"physics"},
    "scipy": {"numerics", "physics", "equilibria", "motion", "charts", "study"},
}
"""The only layers in which a library may be imported. What is not named here and not NumPy is not imported at all."""

BANNED_CALLS = {"eval", "exec", "compile", "__import__", "os.system", "os.popen"}
BANNED_METHODS = {"sympify", "parse_expr", "lambdify", "parse_latex"}
BANNED_MODULES = {"pickle", "marshal", "shelve", "dill", "ctypes", "urllib", "http", "socket", "requests"}

LONGEST_FILE = 400
LONGEST_BODY = 60

EXCEPTIONS: dict[str, str] = {
    "material/compiled.py::compile": "makes a function of a checked tree of arithmetic; no text is compiled",
}
"""What is let off a rule, and why."""


@cache
def tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


def sources() -> list[Path]:
    return sorted(PACKAGE.rglob("*.py"))


def name_of(path: Path) -> str:
    return path.relative_to(PACKAGE).as_posix()


def layer_of(path: Path) -> str:
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


def imports(path: Path) -> Iterator[str]:
    """Every module that a file imports, wherever in it: at the top, in functions, or for type checking only."""
    for node in ast.walk(tree(path)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{name_of(path)}:{node.lineno}: relative import"
            assert node.module is not None
            if node.module == "plastica" or node.module in {f"plastica.{layer}" for layer in RANK}:
                yield from (f"{node.module}.{alias.name}" for alias in node.names)
            else:
                yield node.module


def check_layers(path: Path) -> None:
    """Imports point right only, and the layers of one row never meet."""
    here = layer_of(path)
    for module in imports(path):
        if module.split(".")[0] != "plastica" or here in TOP:
            continue
        there = module.split(".")[1]
        there = "_version" if there == "__version__" else there
        assert there in RANK, f"{name_of(path)} imports {module}, which is in no layer"
        assert here == there or RANK[here] < RANK[there], f"{name_of(path)}: {here} must not know {module}"


def check_homes(path: Path) -> None:
    """Each library is imported in its own layers only, and nothing undeclared is imported."""
    for module in imports(path):
        library = module.split(".")[0]
        if library in sys.stdlib_module_names:
            assert library not in BANNED_MODULES, f"{name_of(path)} imports {library}"
        elif library not in ("plastica", "numpy"):
            assert library in HOMES, f"{name_of(path)} imports {library}, which has no home"
            assert layer_of(path) in HOMES[library], f"{name_of(path)} imports {library}"


def check_calls(path: Path) -> None:
    """Nothing that runs text, swallows every error, or is left to be done."""
    for node in ast.walk(tree(path)):
        where = f"{name_of(path)}:{getattr(node, 'lineno', 0)}"
        if isinstance(node, ast.Call):
            called = ast.unparse(node.func)
            if called in BANNED_CALLS or called.split(".")[-1] in BANNED_METHODS:
                assert f"{name_of(path)}::{called}" in EXCEPTIONS, f"{where}: {called}()"
            assert not any(k.arg == "shell" for k in node.keywords), f"{where}: shell"
        if isinstance(node, ast.ExceptHandler):
            caught = ast.unparse(node.type) if node.type else "everything"
            assert not re.search(r"\b(everything|Exception|BaseException)\b", caught), f"{where}: catches {caught}"
        if isinstance(node, ast.Name):
            assert node.id != "NotImplementedError", f"{where}: not implemented"
        if isinstance(node, ast.Global):
            raise AssertionError(f"{where}: global state")
    assert not re.search(r"\b(TODO|FIXME|XXX|HACK)\b", path.read_text(encoding="utf-8")), name_of(path)


def functions(node: ast.AST, prefix: str = "") -> Iterator[tuple[str, ast.FunctionDef]]:
    """Every function and method that is not inside another function, with its dotted name."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.FunctionDef):
            yield f"{prefix}{child.name}", child
        elif isinstance(child, (ast.ClassDef, ast.If)):
            yield from functions(child, f"{prefix}{child.name}." if isinstance(child, ast.ClassDef) else prefix)


def check_sizes(path: Path) -> None:
    """Files below 400 lines, bodies of functions below 60, their docstrings not counted."""
    key = name_of(path) if path.is_relative_to(PACKAGE) else path.relative_to(ROOT).as_posix()
    length = len(path.read_text(encoding="utf-8").splitlines())
    assert length < LONGEST_FILE or key in EXCEPTIONS, f"{key} has {length} lines"
    for name, function in functions(tree(path)):
        body = function.body[1:] if ast.get_docstring(function) else function.body
        lines = function.body[-1].end_lineno - body[0].lineno + 1 if body else 0  # type: ignore[operator]
        assert lines < LONGEST_BODY or f"{key}::{name}" in EXCEPTIONS, f"{key}: {name} has {lines} lines"


def public(node: ast.AST, prefix: str = "") -> Iterator[tuple[str, ast.FunctionDef | ast.ClassDef]]:
    """Every public class, function and method."""
    for child in ast.iter_child_nodes(node):
        overload = "overload" in {ast.unparse(mark) for mark in getattr(child, "decorator_list", ())}
        if isinstance(child, (ast.FunctionDef, ast.ClassDef)) and not child.name.startswith("_") and not overload:
            yield f"{prefix}{child.name}", child
            if isinstance(child, ast.ClassDef):
                yield from public(child, f"{prefix}{child.name}.")


def listed(docstring: str, section: str) -> list[str] | None:
    """The names in a section of a docstring; None where it has no such section."""
    found = re.search(rf"^{section}\n-+\n(.*?)(?=^\w[\w ]*\n-+\n|\Z)", docstring, re.MULTILINE | re.DOTALL)
    if found is None:
        return None
    heads = re.findall(r"^([*\w][\w*, ]*?)(?: :.*)?$", found[1], re.MULTILINE)
    return [name.strip().lstrip("*") for head in heads for name in head.split(",")]


def fields(node: ast.ClassDef) -> list[str]:
    """The names that a dataclass or a class with `__init__` is made from."""
    for child in node.body:
        if isinstance(child, ast.FunctionDef) and child.name == "__init__":
            return parameters(child)
    given = [c for c in node.body if isinstance(c, ast.AnnAssign) and isinstance(c.target, ast.Name)]
    own = [c for c in given if "ClassVar" not in ast.unparse(c.annotation) and "init=False" not in ast.unparse(c)]
    inherited = [name for base in node.bases for name in fields(classes()[ast.unparse(base)])] if is_model(node) else []
    return inherited + [c.target.id for c in own if isinstance(c.target, ast.Name)]


def is_model(node: ast.ClassDef) -> bool:
    """The two models share the fields of their abstract base."""
    return [ast.unparse(base) for base in node.bases] == ["Model"]


@cache
def classes() -> dict[str, ast.ClassDef]:
    """Every class of the package by its name."""
    return {node.name: node for path in sources() for node in ast.walk(tree(path)) if isinstance(node, ast.ClassDef)}


def parameters(node: ast.FunctionDef) -> list[str]:
    arguments = node.args
    every = [*arguments.posonlyargs, *arguments.args, arguments.vararg, *arguments.kwonlyargs, arguments.kwarg]
    return [a.arg for a in every if a is not None and a.arg not in ("self", "cls")]


def check_docstrings(path: Path) -> None:
    """Everything public says what it is, and what its docstring lists is what there is."""
    assert ast.get_docstring(tree(path)), f"{name_of(path)} does not say what it is"
    for name, node in public(tree(path)):
        where = f"{name_of(path)}: {name}"
        text = ast.get_docstring(node)
        assert text, f"{where} has no docstring"
        assert text.split("\n")[0].rstrip().endswith((".", ":", "?")), f"{where}: first line is no sentence"
        given = fields(node) if isinstance(node, ast.ClassDef) else parameters(node)
        for section in ("Parameters", "Attributes"):
            names = listed(text, section)
            if names is not None and section == "Parameters":
                assert names == given, f"{where}: Parameters lists {names}, but takes {given}"
            elif names is not None and isinstance(node, ast.ClassDef) and given and listed(text, "Parameters") is None:
                missing = set(fields(node)) - set(names)
                assert not missing or path.name == "errors.py", f"{where}: Attributes lacks {missing}"


def check_named_tests(path: Path) -> None:
    """Every test that a docstring names ("Checked by `test_x`") exists."""
    every = {f.stem for f in (ROOT / "tests").glob("test_*.py")}
    for file in (ROOT / "tests").glob("test_*.py"):
        every |= {node.name for node in ast.walk(tree(file)) if isinstance(node, ast.FunctionDef)}
    for named in re.findall(r"Checked by ([^.\n]+)", path.read_text(encoding="utf-8")):
        for test in re.findall(r"\btest_\w+", named):
            assert test in every, f"{path.name} names {test}, which does not exist"


@pytest.mark.parametrize("path", sources(), ids=name_of)
def test_layers(path: Path) -> None:
    check_layers(path)
    check_homes(path)


@pytest.mark.parametrize("path", sources(), ids=name_of)
def test_no_banned_calls(path: Path) -> None:
    check_calls(path)


@pytest.mark.parametrize("path", sources(), ids=name_of)
def test_docstrings(path: Path) -> None:
    check_docstrings(path)
    check_named_tests(path)


def test_every_exception_is_still_needed() -> None:
    for key in EXCEPTIONS:
        file, _, name = key.partition("::")
        text = (PACKAGE / file).read_text(encoding="utf-8")
        assert f"{name}(" in text if name else len(text.splitlines()) >= LONGEST_FILE, key


def project_files() -> list[Path]:
    """The text files of the project: what lies in its folders, not what was built."""
    roots = ("src", "tests", "docs", "examples", "benchmarks", ".ci")
    found = [path for name in roots for path in (ROOT / name).rglob("*") if path.is_file()]
    found += [path for path in ROOT.iterdir() if path.is_file() and path.name != ".git"]
    built = {"__pycache__", "_build", "out"}
    binary = {".png", ".gif", ".mp4", ".nc", ".zip", ".pyc", ".svg"}
    return sorted(p for p in found if p.suffix not in binary and not built & set(p.parts))


@pytest.mark.parametrize(
    "path", [p for p in project_files() if p.suffix == ".py"], ids=lambda p: p.relative_to(ROOT).as_posix()
)
def test_sizes(path: Path) -> None:
    check_sizes(path)


HOSTS = {"www.apache.org", "apache.org", "doi.org", "www.w3.org", "keepachangelog.com", "semver.org", "example.org"}
"""Where a link may lead; anything else, such as the address of a package index, has no place in the project."""

MACHINE = re.compile(r"(?<![\w.~-])/(?:home|root|Users|work|mnt|media|srv|opt|private)/\w")
"""A path of somebody's machine."""


def check_text(path: Path, text: str) -> None:
    """No path of a machine, no host outside the list, no number of a ticket."""
    where = path.name
    assert not MACHINE.search(text), f"{where}: {MACHINE.search(text)}"
    for host in re.findall(r"\bhttps?://([\w.-]+)", text):
        assert host in HOSTS, f"{where} names the host {host}"
    assert not re.search(r"\bissue\s+#?\d+\b", text, re.IGNORECASE), f"{where} names a ticket"


def test_the_project_speaks_of_itself_only() -> None:
    for path in project_files():
        content = path.read_bytes()
        if "hostile" not in path.parts:
            check_text(path, content.decode("utf-8"))


def test_the_text_check_has_teeth() -> None:
    for text in ("see /ho" + "me/someone/x", "from https:" + "//index.example.com/simple", "see iss" + "ue 7"):
        with pytest.raises(AssertionError):
            check_text(Path("a"), text)


BENCHMARKS = sorted((ROOT / "benchmarks").glob("*.py"))


@pytest.mark.parametrize("path", BENCHMARKS, ids=lambda path: path.stem)
def test_benchmarks_know_what_there_is(path: Path) -> None:
    """Whatever a benchmark takes from the package is there; the benchmarks themselves take minutes and are not run."""
    for node in ast.walk(tree(path)):
        if isinstance(node, ast.ImportFrom) and node.module is not None and node.module.startswith("plastica"):
            for alias in node.names:
                if not hasattr(import_module(node.module), alias.name):
                    import_module(f"{node.module}.{alias.name}")


def release(text: str) -> tuple[int, ...]:
    return tuple(int(part) for part in re.findall(r"\d+", text)[:3])


def test_every_dependency_is_pinned_above_its_bound() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").split()
    pins = {name.lower().replace("_", "-"): version for name, version in (line.split("==") for line in lines)}
    wanted = list(project["build-system"]["requires"]) + list(project["project"]["dependencies"])
    wanted += [each for extra in project["project"]["optional-dependencies"].values() for each in extra]
    for requirement in wanted:
        name, bound = re.fullmatch(r"([\w.-]+)>=([\d.]+)", requirement).groups()  # type: ignore[union-attr]
        assert name.lower().replace("_", "-") in pins, f"{name} is not pinned"
        assert release(pins[name.lower().replace("_", "-")]) >= release(bound), requirement
    libraries = {module.split(".")[0] for path in sources() for module in imports(path)}
    always, fast = project["project"]["dependencies"], project["project"]["optional-dependencies"]["fast"]
    declared = {re.split(r"[>=]", each)[0].lower() for each in [*always, *fast]}
    names = {"PIL": "pillow", "pydantic_core": "pydantic", "array_api_compat": "array-api-compat"}
    for library in libraries - set(sys.stdlib_module_names) - {"plastica"}:
        assert names.get(library, library).lower() in declared, f"{library} is imported, but not declared"


HEAVY = ("numpy", "scipy", "sympy", "pint", "pydantic", "xarray", "matplotlib", "h5py", "h5netcdf", "pandas", "PIL")


def loaded_after(code: str) -> set[str]:
    script = f"import json, sys\n{code}\nprint(json.dumps(sorted(sys.modules)), file=sys.stderr)"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=PATIENCE, check=True)
    return set(json.loads(done.stderr.splitlines()[-1]))


def test_importing_the_package_loads_nothing_heavy() -> None:
    assert not {*HEAVY, "click", "rich"} & loaded_after("import plastica")


def test_help_loads_nothing_heavy() -> None:
    assert not set(HEAVY) & loaded_after("from plastica.doors.cli import main\nassert main(['--help']) == 0")


@pytest.mark.parametrize("noun", ["Material", "Load", "Grid"])
def test_nouns_do_not_load_what_only_pictures_and_files_need(noun: str) -> None:
    assert not {"matplotlib", "h5py", "xarray", "pydantic"} & loaded_after(f"import plastica\nplastica.{noun}")


@pytest.mark.parametrize("name", [p.stem for p in sorted((ROOT / "tests").glob("test_*.py"))])
def test_tests_are_run(name: str) -> None:
    """No test is skipped, expected to fail, or named twice in one file, where the first would be lost."""
    module = tree(ROOT / "tests" / f"{name}.py")
    names = [node.name for node in module.body if isinstance(node, ast.FunctionDef)]
    assert len(names) == len(set(names))
    marks = {node.attr for node in ast.walk(module) if isinstance(node, ast.Attribute)}
    assert not marks & {"skip", "skipif", "xfail", "importorskip"}
