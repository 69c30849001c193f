"""Claim: a film shows the rod at its time, something happens in every frame, and the file is whole and small."""

from __future__ import annotations

import base64
import stat
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import plastica as pl
from plastica.errors import ArgumentError, FileError
from plastica.show import encode, film, report, style, view
from tests.commandline import Answer, call, scenario, written

from .pictured import check_nothing_is_solved, not_begun, run


def check_frame_times(solution: pl.Solution, count: int) -> None:
    """Increasing, from the first time to the last, and in every frame something happens."""
    seen = view.view(solution)
    times = view.frame_times(seen, count)
    assert times.size == count
    assert np.all(np.diff(times) > 0.0)
    assert (times[0], times[-1]) == (seen.t[0], seen.t[-1])
    way = np.interp(times, seen.t, seen.path)
    place = seen.time.place(times)
    step = np.diff(0.5 * way + 0.5 * place)
    assert step.min() >= 0.5 / count
    assert step.max() <= 2.0 / count


@pytest.mark.parametrize("name", ["buckles", "held", "long", "jump", "stopped"])
def test_something_happens_in_every_frame(name: str) -> None:
    check_frame_times(run(name), 50)


def test_gif_has_its_frames_loops_and_is_small(tmp_path: Path) -> None:
    path = film.film(run("held"), tmp_path / "rod.gif", seconds=2.0, fps=10.0, width=400)
    assert path == tmp_path / "rod.gif"
    assert [each.name for each in tmp_path.iterdir()] == ["rod.gif"]
    assert path.stat().st_size < 500_000
    with Image.open(path) as picture:
        assert picture.format == "GIF"
        assert picture.n_frames == 20
        assert picture.size[0] == 400
        assert picture.info["loop"] == 0
        durations = []
        for k in range(20):
            picture.seek(k)
            durations.append(picture.info["duration"])
    assert durations == [100] * 19 + [encode.HOLD]


def test_default_film_stays_below_two_megabytes(tmp_path: Path) -> None:
    assert film.film(run("held"), tmp_path / "rod.gif").stat().st_size < 2_000_000


def check_frames_show_the_rod(solution: pl.Solution) -> None:
    """In every frame the drawn rod ends where the free end is at that time, and the dots lie on their curves."""
    seen = view.view(solution)
    times = view.frame_times(seen, 7)
    data = replace(solution, times=times).dataset
    with style.drawing():
        stage = film._stage(seen, times, 400)
        for row in range(times.size):
            stage.show(row)
            x, y = (np.asarray(each, float)[-1] for each in stage.parts["rod"].get_data())
            assert abs(x - data["tip_x"].values[row] / 1e-3) <= 1e-6
            assert abs(y - data["tip_y"].values[row] / 1e-3) <= 1e-6
            stored = np.asarray(stage.parts["dot stored energy"].get_ydata(), float)[0]
            largest = float(np.abs(data["stored_energy"].values).max())
            assert abs(stored * 1e-3 - data["stored_energy"].values[row]) <= 0.02 * largest
            assert stage.parts["clock"].get_text() == seen.time.clock(float(times[row]))


def test_frames_show_the_rod_at_their_time() -> None:
    check_frames_show_the_rod(run("held"))


def test_no_arrow_is_drawn_once_the_load_is_gone() -> None:
    seen = view.view(run("held"))
    with style.drawing():
        stage = film._stage(seen, np.array([43200.0, 172800.0]), 400)
        stage.show(0)
        assert stage.parts["arrow"].get_visible()
        stage.show(1)
        assert not stage.parts["arrow"].get_visible()


@pytest.mark.parametrize("name", ["still", "short", "stopped", "not begun"])
def test_every_run_can_be_filmed(name: str, tmp_path: Path) -> None:
    solution = not_begun() if name == "not begun" else run(name)
    path = film.film(solution, tmp_path / "rod.gif", seconds=0.5, fps=8.0, width=240)
    with Image.open(path) as picture:
        assert picture.n_frames == (1 if name == "not begun" else 4)


def test_a_film_solves_nothing(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    check_nothing_is_solved(
        monkeypatch, lambda solution: film.film(solution, tmp_path / "rod.gif", seconds=0.3, fps=10.0, width=240)
    )


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"path": "rod.avi"}, "`path` must end in .gif or .mp4"),
        ({"path": "rod"}, "`path` must end in .gif or .mp4"),
        ({"seconds": 0.0}, "`seconds` must be"),
        ({"seconds": float("nan")}, "`seconds` must be"),
        ({"seconds": "8"}, "`seconds` must be"),
        ({"fps": 0.5}, "`fps` must be"),
        ({"width": 10_000}, "`width` must be"),
        ({"seconds": 120.0, "fps": 50.0}, "at most 3000 frames"),
        ({"solution": None}, "`solution` must be a Solution"),
    ],
)
def test_impossible_films_are_refused(changes: dict[str, object], words: str, tmp_path: Path) -> None:
    options: dict[str, object] = {"solution": run("short"), "path": "rod.gif", **changes}
    options["path"] = tmp_path / str(options["path"])
    with pytest.raises(ArgumentError, match=words):
        film.film(**options)  # type: ignore[arg-type]
    assert list(tmp_path.iterdir()) == []


def test_without_ffmpeg_an_mp4_is_refused_with_a_way_out(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("shutil.which", lambda name: None)
    with pytest.raises(ArgumentError, match=r"Install ffmpeg, or write a \.gif"):
        film.film(run("short"), tmp_path / "rod.mp4")
    assert list(tmp_path.iterdir()) == []


def stand_in(folder: Path, monkeypatch: pytest.MonkeyPatch, *, fails: bool) -> Path:
    """A program in the place of ffmpeg: it keeps its arguments and the size of what came through the pipe."""
    program = folder / "ffmpeg"
    ending = (
        "sys.stderr.write('no such codec\\n'); sys.exit(1)" if fails else "open(sys.argv[-1], 'wb').write(data[:9])"
    )
    program.write_text(
        f"#!{sys.executable}\nimport sys\ndata = sys.stdin.buffer.read()\n"
        f"open({str(folder / 'seen')!r}, 'w').write(' '.join(sys.argv[1:]) + f' | {{len(data)}}')\n{ending}\n"
    )
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setattr("shutil.which", lambda name: str(program))
    return folder / "seen"


def test_mp4_frames_reach_ffmpeg_whole(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    tools, out = tmp_path / "tools", tmp_path / "out"
    tools.mkdir()
    out.mkdir()
    seen = stand_in(tools, monkeypatch, fails=False)
    film.film(run("short"), out / "rod $(touch x).mp4", seconds=0.5, fps=8.0, width=301)
    command, size = seen.read_text().split(" | ")
    width, height = (int(each) for each in command.split("-s ")[1].split()[0].split("x"))
    assert (width % 2, height % 2) == (0, 0)
    assert int(size) == 4 * 3 * width * height
    assert "-r 8 " in command
    assert [each.name for each in out.iterdir()] == ["rod $(touch x).mp4"]


def test_a_failure_of_ffmpeg_leaves_nothing_behind(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    tools, out = tmp_path / "tools", tmp_path / "out"
    tools.mkdir()
    out.mkdir()
    stand_in(tools, monkeypatch, fails=True)
    with pytest.raises(FileError, match="no such codec"):
        film.film(run("short"), out / "rod.mp4", seconds=0.5, fps=8.0, width=240)
    assert list(out.iterdir()) == []


# -- the film of a run stands in a file and on the page ------------------------------------------------------------


def counted(act: Callable[[], Answer]) -> tuple[Answer, list[int]]:
    """What was answered, and which frames were drawn for it."""
    drawn, sound = [], film._Stage.show

    def show(stage: film._Stage, row: int) -> None:
        drawn.append(row)
        sound(stage, row)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(film._Stage, "show", show)
        return act(), drawn


def check_drawn_once(folder: Path) -> None:
    """Where a run, or `show`, writes both, each frame is drawn once, and the page holds the very film of the file."""
    file = written(folder, scenario(output="report = true\nfilm = \"gif\""))
    show = ("show", folder / "out" / "strut.nc", "--report", folder / "out" / "strut.html", "--film")
    for command in (("run", file, "--output", folder / "out"), (*show, folder / "out" / "strut.gif")):
        answer, drawn = counted(lambda command=command: call(*command))
        assert answer.code == 0, answer.err
        assert drawn == list(range(100))
        inside = base64.b64encode((folder / "out" / "strut.gif").read_bytes()).decode()
        assert inside in (folder / "out" / "strut.html").read_text(encoding="utf-8")
        (folder / "out" / "strut.gif").unlink()
        (folder / "out" / "strut.html").unlink()


def test_what_page_and_file_show_is_drawn_once(tmp_path: Path) -> None:
    check_drawn_once(tmp_path)


def test_page_and_film_are_as_each_alone(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(film, "FPS", 1.0)
    together = report.report_and_film(run("held"), tmp_path / "both.html", tmp_path / "both.gif")
    assert together == [tmp_path / "both.html", tmp_path / "both.gif"]
    page = report.report(run("held"), tmp_path / "alone.html")
    clip = film.film(run("held"), tmp_path / "alone.gif", fps=1.0)
    assert page.read_bytes() == together[0].read_bytes()
    assert clip.read_bytes() == together[1].read_bytes()
    assert report.report_and_film(run("held"), None, None) == []
    assert report.report_and_film(run("held"), None, tmp_path / "film.gif") == [tmp_path / "film.gif"]


def test_a_page_beside_an_mp4_has_its_film(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    tools, out = tmp_path / "tools", tmp_path / "out"
    tools.mkdir()
    out.mkdir()
    seen = stand_in(tools, monkeypatch, fails=False)
    monkeypatch.setattr(film, "FPS", 1.0)
    report.report_and_film(run("short"), out / "rod.html", out / "rod.mp4")
    assert "-r 1 " in seen.read_text()
    assert "data:image/gif;base64" in (out / "rod.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(("page", "clip"), [("rod.txt", "rod.gif"), ("rod.html", "rod.avi"), ("rod.html", "rod.mp4")])
def test_nothing_is_written_where_one_name_is_wrong(
    page: str, clip: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr("shutil.which", lambda name: None)
    with pytest.raises(ArgumentError, match="`path` must end in"):
        report.report_and_film(run("short"), tmp_path / page, tmp_path / clip)
    assert list(tmp_path.iterdir()) == []
