"""Bakes on a dask cluster: outcomes come back, a dead worker loses nothing, trouble is one line."""

import json
import os
import shutil
import signal
import threading
import time
from pathlib import Path

import pytest

from bakery.bake import batch, pipeline
from bakery.errors import InputError
from bakery.farm import cluster

distributed = pytest.importorskip("distributed")
FEW = Path(__file__).parents[1] / "few.toml"
QUICK = ["--preset", "small", "--resolution", "512", "--generator", "rendered", "--hair", "layer",
         "--expressions", FEW, "--set", "texture.views=[0.0]", "--set", "bundle.formats=[]"]  # fmt: skip


@pytest.fixture
def running(tmp_path):
    """A cluster of one worker in this process."""
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=2, processes=False, dashboard_address=None,
        local_directory=tmp_path,
    ) as made:  # fmt: skip
        yield made


def requests(folder, names):
    common = pipeline.Request(folder / "x.png", folder / "x.avatar")
    return batch.requests_of([(folder / n, folder / f"{n}.avatar") for n in names], common)


def test_each_outcome_comes_back_and_bakes_take_turns(running, tmp_path, monkeypatch):
    busy = threading.Lock()

    def bake(request):
        assert busy.acquire(blocking=False), "two bakes in one process"
        time.sleep(0.02)
        busy.release()
        bad = request.photo.name == "bad.png"
        return batch.Outcome(str(request.photo), "", "failed" if bad else "baked")

    monkeypatch.setattr(cluster, "bake", bake)
    names = [f"{n}.png" for n in range(6)] + ["bad.png"]
    found = list(cluster.bake_on(running.scheduler_address, requests(tmp_path, names)))
    assert sorted(Path(one.photo).name for one in found) == sorted(names)
    assert [Path(one.photo).name for one in found if one.state == "failed"] == ["bad.png"]


def test_what_breaks_on_a_worker_is_told_of_its_photo(running, tmp_path, monkeypatch):
    def bake(request):
        raise RuntimeError("a screw is loose\nsecond line")

    monkeypatch.setattr(cluster, "bake", bake)
    (found,) = cluster.bake_on(running.scheduler_address, requests(tmp_path, ["a.png"]))
    assert found.state == "failed" and found.error == "RuntimeError: a screw is loose"


def test_another_bakery_on_a_worker_is_refused(tmp_path):
    (one,) = requests(tmp_path, ["a.png"])
    found = cluster.run_task(one, "of another version")
    assert found.state == "failed" and "another bakery" in found.error


def test_paths_are_whole_for_workers_elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("mine.npz").touch()
    asked = pipeline.Request(
        Path("a.png"), Path("a.avatar"), head="mine.npz", expressions=Path("e.toml")
    )
    sent = cluster._absolute(asked)
    assert sent.photo == tmp_path / "a.png" and sent.output == tmp_path / "a.avatar"
    assert sent.head == str(tmp_path / "mine.npz") and sent.expressions == tmp_path / "e.toml"
    assert cluster._absolute(pipeline.Request(Path("a"), Path("b"))).head == "makehuman"


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "nonsense://x", "tcp://"])
def test_without_a_scheduler_it_is_one_line(address, tmp_path, monkeypatch):
    monkeypatch.setattr(cluster, "WAIT", 0.5)
    with pytest.raises(InputError, match="no dask scheduler there"):
        list(cluster.bake_on(address, requests(tmp_path, ["a.png"])))


@pytest.mark.slow  # minutes: three real bakes, one of them twice
def test_a_killed_worker_costs_no_portrait(bakery, process, tmp_path):
    """Two workers, one killed with SIGKILL in the middle: every portrait is baked, and as alone."""
    samples = sorted((Path(__file__).parents[2] / "samples").glob("*.jpg"))[:3]
    for sample in samples:
        shutil.copy(sample, tmp_path)
    photos = [tmp_path / sample.name for sample in samples]
    killed = []

    def kill(made):
        work = list(tmp_path.glob("out/.*work"))
        while not work:
            time.sleep(0.2)
            work = list(tmp_path.glob("out/.*work"))
        process = next(iter(made.workers.values())).pid
        os.kill(process, signal.SIGKILL)
        killed.append(process)

    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None,
        local_directory=tmp_path / "dask",
    ) as made:  # fmt: skip
        thread = threading.Thread(target=kill, args=[made], daemon=True)
        thread.start()
        done = bakery(
            "farm",
            *photos,
            "-o",
            tmp_path / "out",
            "--dask",
            made.scheduler_address,
            "--json",
            *QUICK,
        )
        thread.join()
    assert done.returncode == 0, done.stderr
    rows = [json.loads(line) for line in done.stdout.splitlines()]
    assert killed and [row["state"] for row in rows] == ["baked"] * 3
    assert sorted(Path(row["photo"]) for row in rows) == photos
    alone = tmp_path / "alone.avatar"
    assert process("build", photos[0], "-o", alone, *QUICK).returncode == 0
    manifest = "avatar.json"
    assert (alone / manifest).read_bytes() == (
        tmp_path / "out" / f"{photos[0].stem}.avatar" / manifest
    ).read_bytes()
    assert not [p for p in (tmp_path / "out").iterdir() if p.name.startswith(".")]
