"""Claim: a file from outside takes no more memory than its size allows, and its words cannot steer a terminal."""

from __future__ import annotations

import json
import unicodedata
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import plastica as pl
from plastica.errors import FileError, safe_text
from plastica.motion import store
from tests.commandline import call, scenario, written
from tests.support import DATA, pair


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A sound result of a few kilobytes."""
    sol = pl.solve(pl.Strut(pair("A", 2.0), pl.Load(thrust=1.0), pl.Grid(4)), 0.1, until=0.5, rtol=1e-4)
    return sol.save(tmp_path_factory.mktemp("sound") / "run.nc")


def large(group: Any, name: str = "more") -> None:
    """Numbers that were never written: eight gigabytes in a few hundred bytes."""
    group.create_dataset(name, shape=(10**9,), dtype="f8", chunks=(2**16,), compression="gzip")


def instead(file: Any) -> None:
    """The same in the place of the states."""
    del file["history/node_y"]
    large(file["history"], "node_y")


def texts(file: Any) -> None:
    """Texts of a kilobyte each in the place of the states, which no digest covers."""
    del file["history/node_y"]
    file["history"].create_dataset("node_y", shape=(10**7,), dtype="S1024", chunks=(2**10,), compression="gzip")


def pair_of_values(file: Any) -> None:
    """Pairs of numbers, which are neither."""
    file.create_dataset("pairs", shape=(10**9,), dtype=[("a", "f8"), ("b", "f8")], chunks=(2**10,), compression="gzip")


def many(file: Any) -> None:
    """A hundred datasets, each of a size that would do."""
    for i in range(100):
        file.create_dataset(f"part{i}", shape=(10**7,), dtype="f8", chunks=(2**16,), compression="gzip")


def device(file: Any) -> None:
    """Values that lie in a device."""
    file.create_dataset("elsewhere", shape=(1000,), dtype="f8", external=[("/dev/zero", 0, 8000)])


def virtual(file: Any) -> None:
    """Values that lie in another file."""
    import h5py

    layout = h5py.VirtualLayout(shape=(1000,), dtype="f8")
    layout[:] = h5py.VirtualSource("other.nc", "x", shape=(1000,))
    file.create_virtual_dataset("elsewhere", layout)


def outside(file: Any) -> None:
    """A link to another file."""
    import h5py

    file["elsewhere"] = h5py.ExternalLink("/etc/passwd", "x")


def endless(file: Any) -> None:
    """A group that contains itself, under two names."""
    file["history/again"] = file["history"]
    file["history/more"] = file["history"]


BOMBS = (large, instead, texts, pair_of_values, many, device, virtual, outside, endless)


def check_bomb(make: Callable[[Any], None], sound: Path, folder: Path, patch: pytest.MonkeyPatch) -> None:
    """Refused before a single value is read."""
    import h5py

    bomb = folder / "bomb.nc"
    bomb.write_bytes(sound.read_bytes())
    with h5py.File(bomb, "r+") as file:
        make(file)
    assert bomb.stat().st_size < 500_000

    def read(*_: object) -> Any:
        raise AssertionError("values were read")

    patch.setattr(h5py.Dataset, "__getitem__", read)
    with pytest.raises(FileError, match="is damaged, or not a result of plastica"):
        pl.read(bomb)


@pytest.mark.parametrize("make", BOMBS, ids=lambda make: str(make.__name__))
def test_what_would_unpack_to_more(
    make: Callable[[Any], None], sound: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    check_bomb(make, sound, tmp_path, monkeypatch)


def test_a_scenario_that_goes_on_from_such_a_file(sound: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    check_bomb(instead, sound, tmp_path, monkeypatch)
    file = written(tmp_path, scenario(initial='result = "bomb.nc"'))
    answer = call("run", file, "--output", tmp_path / "out")
    assert answer.code == 2
    assert "bytes of values" in answer.err
    assert not (tmp_path / "out").exists()


def test_sound_files_of_all_days_are_read(sound: Path, tmp_path: Path) -> None:
    """Also one whose values another program has packed."""
    import h5py

    assert pl.read(sound).status.ok
    assert pl.read(DATA / "result_v1.nc").status.ok
    with h5py.File(sound, "r") as file, h5py.File(tmp_path / "packed.nc", "w") as packed:
        packed.attrs.update(file.attrs)
        for name, data in store._items(file):
            packed.create_dataset(name, data=data[()], compression="gzip" if data.shape else None)
            packed[name].attrs.update({k: v for k, v in data.attrs.items() if k in ("units", "long_name")})
    assert pl.read(tmp_path / "packed.nc") == pl.read(sound)


def test_the_digest_takes_blocks(sound: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of any size, with the same outcome."""
    for block in (1, 100, 10**9):
        monkeypatch.setattr(store, "BLOCK", block)
        assert pl.read(sound).status.ok


# -- words that would steer a terminal -----------------------------------------------------------------------------

EVIL = "\x1b]0;owned\x07\x1b[2J\r\x00\x08\x7f\x9b31m\u202e\u2066\u2069\u200f\ufeff\u2028\U000e0041"
"""Controls of old and new, directions of writing, marks without width, a tag."""


def evil_result(sound: Path, folder: Path) -> Path:
    """A result whose every word was changed, and whose seal is right again."""
    import h5py

    path = folder / "evil.nc"
    path.write_bytes(sound.read_bytes())
    with h5py.File(path, "r+") as file:
        meta = json.loads(str(file.attrs["plastica_meta"]))
        meta["status"]["sentence"] += EVIL
        meta["status"]["code"] += EVIL
        meta["notes"] = [f"a note{EVIL}"]
        meta["method"] += EVIL
        meta["initial"] += EVIL
        meta["provenance"] = {"title": f"a title{EVIL}", "scenario": f"a = 1{EVIL}", "scenario_file": f"x{EVIL}.toml"}
        meta["model"]["material"]["name"] = f"a name{EVIL}"
        store._seal(file, json.dumps(meta, sort_keys=True))
    return path


def steering(text: str) -> set[str]:
    """Characters in a text that a terminal obeys instead of showing."""
    return {
        each for each in text if each != "\n" and unicodedata.category(each) in {"Cc", "Cf", "Cs", "Co", "Zl", "Zp"}
    }


def check_words(sound: Path, folder: Path) -> None:
    """Whatever the words of a file are, none steers the terminal, and a reader of JSON gets them as they are."""
    path = evil_result(sound, folder)
    shown = call("show", path)
    assert shown.code == 0
    assert "a title\\x1b]0;owned\\x07" in shown.out
    assert "\\u202e" in shown.out
    as_json = call("show", path, "--json")
    assert json.loads(as_json.out)["title"] == f"a title{EVIL}"
    sol = pl.read(path)
    told = [shown.out, as_json.out, str(sol), str(sol.status)]
    told += [str(answer) for answer in hostile_answers(folder)]
    assert not set().union(*map(steering, told))


def hostile_answers(folder: Path) -> list[str]:
    """What the command line says of names and contents that are meant to steer."""
    name = f"x{EVIL}.toml".replace("\x00", "")
    good = written(folder, scenario(), name)
    bad = written(folder, scenario(material=f'name = "y{EVIL.encode("unicode_escape").decode()}"'), f"bad{name}")
    junk = folder / f"junk{name}"
    junk.write_bytes(b"\x1b[31m\xff")
    answers = [
        call("check", good),
        call("check", bad),
        call("run", junk),
        call("show", junk),
        call("new", good),
        call("check", folder),
        call("run", good, "--output", folder / f"o{name}"),
        call(f"ru{name}"),
        call("export", folder / "evil.nc"),
        call("export", folder / "evil.nc", f"tip_y{name}"),
        call("new", folder / f"n{name}"),
    ]
    return [text for answer in answers for text in (answer.out, answer.err)]


def test_words_never_steer_a_terminal(sound: Path, tmp_path: Path) -> None:
    check_words(sound, tmp_path)


def test_safe_text_leaves_what_is_harmless() -> None:
    harmless = "γ² of 5\u202f%: 0.1 EI/L²\n  second line — Stäbchen 棒 😀"
    assert safe_text(harmless) == harmless
    assert safe_text("a\tb\x9c") == "a\\x09b\\x9c"
    assert safe_text(Path("x")) == "x"
