"""Claim: whatever was damaged, killed or tried by two at once, a run that is taken up ends as if nothing had been."""

from __future__ import annotations

import hashlib
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

import plastica as pl
from plastica.errors import FileError, StorageError
from plastica.locks import held
from plastica.motion import checkpoint
from plastica.motion.solve import solve
from tests.commandline import call, scenario, written
from tests.support import pair

RUN = {"curvature": "0.3*cos(2*s)", "until": 9.0, "rtol": 1e-4}
"""About twenty legs in a moment."""


def strut() -> pl.Strut:
    return pl.Strut(pair("A", 5.0), pl.Load(thrust=pl.programs.cycles(0.0, 3.0, 1.0, 9)), pl.Grid(nodes=6))


def kept(folder: Path, every: float = 0.0, **changed: object) -> pl.Solution:
    return solve(strut(), **{**RUN, **changed}, checkpoint=folder, checkpoint_every=every)  # type: ignore[arg-type]


def segments(folder: Path) -> list[Path]:
    return sorted(folder.glob(checkpoint.PATTERN))


def taken_up(folder: Path, whole: pl.Solution) -> None:
    """Resume, twice: the second time nothing is left to be computed, for what lies there is whole again."""
    for _ in range(2):
        again = solve(strut(), **RUN, checkpoint=folder, checkpoint_every=0.0, resume=True)  # type: ignore[arg-type]
        assert again == whole
        assert again.dataset.identical(whole.dataset)
        assert {path.name for path in folder.iterdir()} == {path.name for path in segments(folder)}


def truncated(paths: list[Path], i: int) -> None:
    paths[i].write_bytes(paths[i].read_bytes()[:-30])


def flipped(paths: list[Path], i: int) -> None:
    data = bytearray(paths[i].read_bytes())
    data[len(data) // 2] ^= 4
    paths[i].write_bytes(data)


def altered(paths: list[Path], i: int) -> None:
    """A segment that is whole, with another number in it."""
    arrays = checkpoint._read(paths[i])
    arrays["y0"][-1, 0] += 1e-3
    np.savez(paths[i], **arrays)  # type: ignore[arg-type]


def missing(paths: list[Path], i: int) -> None:
    paths[i].unlink()


def swapped(paths: list[Path], i: int) -> None:
    other = paths[i - 1]
    first, second = paths[i].read_bytes(), other.read_bytes()
    paths[i].write_bytes(second)
    other.write_bytes(first)


def doubled(paths: list[Path], i: int) -> None:
    shutil.copyfile(paths[i - 1], paths[i])


def _in_the_directory(offset: int, bit: int) -> Callable[[list[Path], int], None]:
    def damage(paths: list[Path], i: int) -> None:
        data = bytearray(paths[i].read_bytes())
        data[data.rfind(b"PK\x01\x02") + offset] ^= bit
        paths[i].write_bytes(data)

    return damage


encrypted, of_a_later_version = _in_the_directory(8, 1), _in_the_directory(6, 0x40)
encrypted.__name__, of_a_later_version.__name__ = "encrypted", "of a later version"

DAMAGES = (truncated, flipped, altered, missing, swapped, doubled, encrypted, of_a_later_version)


def check_damage(folder: Path, damage: Callable[[list[Path], int], None], places: slice = slice(None)) -> None:
    """Every segment in turn is damaged; what is taken up ends the same to the last bit."""
    whole = kept(folder)
    sound = {path.name: path.read_bytes() for path in segments(folder)}
    assert len(sound) >= 15
    for i in list(range(len(sound)))[places]:
        for name, data in sound.items():
            (folder / name).write_bytes(data)
        damage(segments(folder), i)
        taken_up(folder, whole)


@pytest.mark.parametrize("damage", DAMAGES, ids=lambda damage: str(damage.__name__))
def test_any_segment_may_be_damaged(damage: Callable[[list[Path], int], None], tmp_path: Path) -> None:
    check_damage(tmp_path / "c", damage)


def regrouped(folder: Path, by: int) -> None:
    """Write the legs of a checkpoint anew, so many to a segment."""
    found = checkpoint.Checkpoint(folder, identity_in(folder), every=1e9)
    legs = list(found.load())
    found.clear(keep_folder=True)
    for i, leg in enumerate(legs):
        found.keep(leg)
        if i % by == by - 1:
            found.flush()
    found.flush()


def identity_in(folder: Path) -> str:
    return str(checkpoint._read(segments(folder)[0])["identity"])


def check_splice(folder: Path) -> None:
    """What a former run has left behind, legs cut elsewhere, does not follow what a killed resume has written."""
    whole = kept(folder)
    former = {path.name: path.read_bytes() for path in segments(folder)}
    regrouped(folder, 2)
    written = segments(folder)
    for name, data in former.items():
        if name >= written[3].name:
            (folder / name).write_bytes(data)
    taken_up(folder, whole)


def test_what_does_not_follow_is_not_taken(tmp_path: Path) -> None:
    check_splice(tmp_path / "c")


def test_what_does_not_follow_is_removed(tmp_path: Path) -> None:
    folder = tmp_path / "c"
    kept(folder)
    paths = segments(folder)
    truncated(paths, 4)
    (folder / ".legs-000009.abcdefg1.npz").write_bytes(b"half")
    (folder / "legs-notes.txt").write_text("mine")
    assert list(checkpoint.Checkpoint(folder, identity_in(folder)).load())
    assert [path.name for path in segments(folder)] == [path.name for path in paths[:4]]
    assert (folder / "legs-notes.txt").is_file()
    assert not list(folder.glob(".legs-*"))


def test_another_run_is_refused_and_left_alone(tmp_path: Path) -> None:
    kept(tmp_path / "c")
    before = {path.name: path.read_bytes() for path in (tmp_path / "c").iterdir()}
    with pytest.raises(FileError, match="another run"):
        solve(strut(), **{**RUN, "until": 8.0}, checkpoint=tmp_path / "c", resume=True)  # type: ignore[arg-type]
    assert {path.name: path.read_bytes() for path in (tmp_path / "c").iterdir()} == before


def test_a_segment_that_would_unpack_to_more_is_not_read(tmp_path: Path) -> None:
    whole = kept(tmp_path / "c")
    path = segments(tmp_path / "c")[0]
    arrays = {**checkpoint._read(path), "y0": np.zeros((1_000_000, 8))}
    np.savez_compressed(path, **arrays)
    assert path.stat().st_size < 200_000
    with pytest.raises(ValueError, match="compressed"):
        checkpoint._read(path)
    taken_up(tmp_path / "c", whole)


# -- two processes ------------------------------------------------------------------------------------------------

HOLDING = """
import sys
from pathlib import Path
from plastica.locks import held
with held(Path(sys.argv[1])):
    print("held", flush=True)
    sys.stdin.readline()
"""


@contextmanager
def holding(folder: Path) -> Iterator[subprocess.Popen[str]]:
    """Another process that works in a folder until it is killed or let go on."""
    command = [sys.executable, "-c", HOLDING, str(folder)]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None
        assert process.stdout.readline() == "held\n"
        yield process
    finally:
        process.kill()
        process.communicate()


def digests(folder: Path) -> dict[str, str]:
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in folder.rglob("*")
        if path.is_file()
    }


def check_second_is_told(folder: Path) -> None:
    """While another process works in a folder it is refused, and left as it is; once that is killed, it is free."""
    whole = kept(folder)
    with holding(folder) as process:
        before = digests(folder)
        for resume in (True, False):
            with pytest.raises(StorageError, match="is in use: another process is at work there"):
                solve(strut(), **RUN, checkpoint=folder, resume=resume)  # type: ignore[arg-type]
        assert digests(folder) == before
        process.kill()
        process.wait()
        taken_up(folder, whole)


def test_a_second_process_is_told(tmp_path: Path) -> None:
    check_second_is_told(tmp_path / "c")


def test_automatic_nodes_are_kept_from_others_too(tmp_path: Path) -> None:
    model = strut().with_grid(pl.Grid(nodes="auto"))
    with holding(tmp_path / "c"), pytest.raises(StorageError, match="is in use"):
        solve(model, **RUN, checkpoint=tmp_path / "c")  # type: ignore[arg-type]


def test_a_second_run_of_the_command_line_is_told(tmp_path: Path) -> None:
    file = written(tmp_path, scenario())
    folder = tmp_path / "out" / ".strut.checkpoint"
    folder.parent.mkdir()
    with holding(folder) as process:
        answer = call("run", file, "--output", tmp_path / "out")
        assert answer.code == 1
        assert f"`{folder}` is in use: another process is at work there." in answer.err
        assert not (tmp_path / "out" / "strut.nc").exists()
        process.kill()
        process.wait()
        assert call("run", file, "--output", tmp_path / "out").code == 0
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["strut.nc"]


def test_nothing_is_left_where_nothing_was_done(tmp_path: Path) -> None:
    with pytest.raises(pl.errors.ArgumentError):
        solve(strut(), curvature="1/(", until=1.0, checkpoint=tmp_path / "c")
    with held(tmp_path / "d"):
        assert (tmp_path / "d").is_dir()
    assert list(tmp_path.iterdir()) == []


def check_link(folder: Path) -> None:
    """A link in the place of the checkpoint is refused, and nothing that it leads to is touched."""
    file = written(folder, scenario())
    elsewhere = folder / "elsewhere"
    kept(elsewhere)
    before = digests(elsewhere)
    (folder / "out").mkdir()
    (folder / "out" / ".strut.checkpoint").symlink_to(elsewhere)
    answer = call("run", file, "--output", folder / "out")
    assert answer.code == 2
    assert "is a link, which is not followed" in answer.err
    assert digests(elsewhere) == before
    assert not (folder / "out" / "strut.nc").exists()


def test_a_link_is_not_followed(tmp_path: Path) -> None:
    check_link(tmp_path)
