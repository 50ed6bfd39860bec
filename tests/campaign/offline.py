"""Every command of bakery, as a process without a network: none asks for one.

A command runs in a network namespace of its own (`unshare -rn`), in which not even the loopback is up,
and under `strace`, which writes every call about a socket, those too that fail and are passed over.
"""

import contextlib
import importlib.util
import json
import re
import runpy
import shutil
import subprocess
import sys
from pathlib import Path

import base

MUST = "every command: 0 network calls, and it ends well without a network"
TRACED = ("connect", "sendto", "sendmsg", "sendmmsg", "bind", "listen")
CALL = re.compile(r"^\d+ +(\w+)\((.*)$", re.M)
LEFT_OUT = {  # leaves of the group of commands -> why
    "heads build makehuman": "needs a wheel of another project, which has to be downloaded",
    "heads learn": "needs that wheel and a collection of photos",
    "heads import ict": "needs ICT-FaceKit, which has to be downloaded",
}
GROUPS = ("train", "evaluate")  # hours, and collections of photos


def run(inputs: base.Inputs, place: Path, count: int | None = None) -> base.Row:
    """Run all commands once.

    Args:
        place: a folder to work in.
        count: only so many commands, the first ones; then none is missed.
    """
    row = base.Row("network", MUST)
    place = place / "network"
    place.mkdir(parents=True)
    inside, traced = _inside(), shutil.which("strace") is not None
    seen: dict[str, set[str]] = {}
    if traced:
        _check_trace(row, place)
    lines = commands(inputs, place)
    for number, (name, arguments) in enumerate(lines[:count]):
        line = [sys.executable, "-m", "bakery", *name.split(), *arguments]
        trace = place / f"trace-{number}"
        watched = [*_strace(trace), *line] if traced else line
        row.cases += 1
        text = " ".join(line[2:])
        try:
            done = subprocess.run(
                [*inside, *watched],
                cwd=place,
                capture_output=True,
                text=True,
                timeout=3 * base.HANG,
            )
        except subprocess.TimeoutExpired:
            row.fail(f"{text}: hangs")
            continue
        if done.returncode:
            row.fail(f"{text}: exit code {done.returncode}: {done.stderr[-300:]}")
        if traced:
            for found in network(trace.read_text("utf-8", "replace"), seen, name):
                row.fail(f"{text}: {found}")
    if count is None:
        for name in sorted(leaves() - {name for name, _ in lines} - LEFT_OUT.keys() - {""}):
            row.fail(f"{name}: a command that this row does not know")
    row.note = _note(inside, traced, seen)
    return row


def network(trace: str, seen: dict[str, set[str]], name: str) -> list[str]:
    """Calls of a trace that reach for a network; others are put into `seen` by their family."""
    found = []
    for call, rest in CALL.findall(trace):
        family = (re.search(r"\b(?:AF|PF)_[A-Z0-9]+", rest) or [""])[0]
        if call in TRACED and family in ("AF_INET", "AF_INET6"):
            found.append(f"{call}({rest[:120]}")
        elif family:
            seen.setdefault(f"{call} {family}", set()).add(name)
    return found


def _inside() -> list[str]:
    """The beginning of a line that runs without a network; empty where the system forbids it."""
    line = ["unshare", "-rn"]
    with contextlib.suppress(OSError):
        if subprocess.run([*line, "true"], capture_output=True).returncode == 0:
            return line
    return []


def _strace(trace: Path) -> list[str]:
    # -f with a filter in the kernel: other calls are not slowed, so that nothing times out.
    return ["strace", "-f", "--seccomp-bpf", "-qq", "-e", "trace=%network", "-o", str(trace)]


def _check_trace(row: base.Row, place: Path) -> None:
    """The row sees what it looks for, in a child of a child too."""
    trace = place / "trace-check"
    for call in (
        "import socket; socket.socket(type=socket.SOCK_DGRAM).sendto(b'x', ('127.0.0.1', 9))",
        "import socket; socket.socket(socket.AF_INET6).connect_ex(('::1', 9))",
        "import socket; socket.socket().bind(('127.0.0.1', 0))",
    ):
        nested = f"import subprocess, sys; subprocess.run([sys.executable, '-c', {call!r}])"
        subprocess.run([*_strace(trace), sys.executable, "-c", nested], capture_output=True)
        if not network(trace.read_text("utf-8", "replace"), {}, ""):
            row.fail(f"the row itself: strace does not show {call}")


def _note(inside: list[str], traced: bool, seen: dict[str, set[str]]) -> str:
    said = [] if inside else ["unshare does not work here: a network was there"]
    if not traced:
        return "; ".join([*said, "no strace: only that commands end well without a network"])
    others = [f"{call} ({', '.join(sorted(names))[:80]})" for call, names in sorted(seen.items())]
    return "; ".join([*said, "other sockets: " + (", ".join(others) or "none")])


def leaves() -> set[str]:
    """The names of all commands, as "heads import mesh", without GROUPS."""
    import click

    from bakery.cli import main as module

    top = module.LazyGroup()
    found: set[str] = set()

    def walk(group: click.Group, before: str) -> None:
        context = click.Context(group)
        for name in group.list_commands(context):
            command, path = group.get_command(context, name), f"{before} {name}".strip()
            if isinstance(command, click.Group) and path not in GROUPS:
                walk(command, path)
            elif path not in GROUPS:
                found.add(path)

    walk(top, "")
    return found


def exported(bundle: Path, folder: Path) -> list[tuple[str, list[str]]]:
    """`bakery export` of a bundle in every format whose extra is installed, into a folder."""
    from bakery.plugins import known, plug_in

    out = []
    for name in sorted(known("exporters")):
        if name == "usd" and importlib.util.find_spec("pxr") is None:
            continue
        target = folder / f"{name}{plug_in('exporters', name).suffix}"
        words = [str(bundle), "--format", name, "--side", "256", "-o", str(target)]
        out.append(("export", words))
    return out


def commands(inputs: base.Inputs, place: Path) -> list[tuple[str, list[str]]]:
    """(command, arguments) in an order in which later ones read what earlier ones wrote into `place`."""
    photo, bundle, take, clip = (
        str(path) for path in (inputs.photo, inputs.bundle, inputs.take, inputs.clip)
    )
    _extra_inputs(inputs, place)
    given = [photo, "--landmarks", "points.json"]
    small = ["--size", "64"]
    films = [("animate", [bundle, "--curves", take, *small, "-o", out])
             for out in ("a.webm", "a.mp4", "frames/a.%04d.png")]  # fmt: skip
    signing = importlib.util.find_spec("c2pa") is not None
    signed = [
        ("sign", [bundle, "signer-chain.pem", "signer-key.pem", "-o", "signed.avatar"]),
        ("verify", ["signed.avatar", "--trust", "Test authority.pem"]),
        ("build", [photo, *base.QUICK, "--sign", "signer-chain.pem", "signer-key.pem", "-o", "s.avatar"]),
    ]  # fmt: skip
    if not signing:
        signed = [("sign", ["--help"]), ("verify", ["--help"])]
    pictures = ["--portraits", "portraits", "--points", "points.npz"]
    return [
        ("", ["--help"]), ("", ["--version"]),
        ("doctor", []), ("shapes", ["--json"]), ("presets list", []), ("presets show", ["default"]),
        ("heads list", []), ("heads show", ["makehuman"]), ("heads describe", ["makehuman"]),
        ("detect", [photo, "-o", "points.json", "--preview", "points.png"]),
        ("segment", [photo, "-o", "labels.png"]),
        ("fit", [*given, *base.QUICK, "-o", "fit.json"]),
        ("texture", [*given, *base.QUICK, "--fit", "fit.json", "-o", "textures.npz"]),
        ("albedo", [*given, *base.QUICK, "--fit", "fit.json", "-o", "albedo.exr"]),
        ("hair", [*given, *base.QUICK, "--fit", "fit.json", "-o", "hair.glb"]),
        ("mask", [*base.QUICK, "-o", "masks.npz"]),
        ("bundle", [*given, *base.QUICK, "--fit", "fit.json", "--textures", "textures.npz",
                    "--masks", "masks.npz", "--consent", "yes", "-o", "steps.avatar"]),
        ("build", [photo, *base.QUICK, "--keep-photo", "-o", "a.avatar"]),
        ("build", [photo, "--preset", "small", "--complete", "synthesize", "-o", "painted.avatar"]),
        ("build", ["portraits", *base.QUICK, "--jobs", "2", "-o", "many"]),
        ("farm", [photo, "-o", "farm", "--format", "openjd", "--to", "job.json"]),
        ("inspect", [bundle]), ("inspect", ["points.png"]), ("validate", [bundle]),
        *signed, *exported(inputs.bundle, place / "exports"),
        ("export", [bundle, "--format", "glb", "--curves", take, "-o", "talking.glb"]),
        ("preview", [bundle, "-o", "page.html"]), ("preview", [bundle, "--module", "site"]),
        *(("render", [bundle, *small, "-o", f"r.{kind}"]) for kind in ("png", "jpg", "webp", "exr")),
        ("recover", [bundle, "jawOpen", "-o", "facs.exr"]),
        ("generate", [photo, "--weights", "jawOpen=0.5", "-o", "generated.png"]),
        ("track", [clip, "--rate", "25", "-o", "take.csv"]), *films,
        ("perform", [bundle, clip, "--rate", "25", *small, "-o", "avatar.webm"]),
        ("perform", [photo, clip, "--rate", "25", *small, "--by", "transfer", "-o", "transfer.webm"]),
        ("perform", [photo, clip, "--rate", "25", *small, "--by", "network", "-o", "network.webm"]),
        ("retarget", [take, "--gain", "1.2", "-o", "louder.csv"]),
        ("heads sheet", ["makehuman", "-o", "sheet"]),
        ("heads embed", ["makehuman", *pictures, "--rounds", "1", "-o", "embedded.npz"]),
        ("heads measure", ["makehuman", *pictures, "--mixes", "2"]),
        ("heads import mesh", ["head.obj", "--units", "m", "-o", "imported.npz"]),
        ("synth samples", ["anna", "-o", "samples"]),
        ("synth failures", [_first_failure(), "-o", "failures"]),
        ("synth training", ["-n", "1", "-o", "training"]),
        ("synth portraits", ["-n", "1", "-o", "painted"]),
        ("synth pairs", ["-n", "2", "--size", "64", "-o", "pairs"]),
        ("synth sheet", ["pairs", "-n", "2", "-o", "pairs.png"]),
        ("synth performers", ["-n", "1", "--expressions", "2", "-o", "performers"]),
        ("synth skins", ["portraits", "-o", "skins"]),
    ]  # fmt: skip


def _first_failure() -> str:
    from bakery.synth import failures

    return next(iter(failures.CASES))


def _extra_inputs(inputs: base.Inputs, place: Path) -> None:
    """What single commands read: a signer, photos with points, a mesh."""
    import numpy as np

    if importlib.util.find_spec("c2pa") is not None:
        made = runpy.run_path(str(base.ROOT / "tests" / "authority.py"))
        made["Authority"](place).signer()
    portraits = place / "portraits"
    portraits.mkdir(exist_ok=True)
    for name in ("one_neutral", "two_neutral"):
        shutil.copy(inputs.photo, portraits / f"{name}.jpg")
    faces = json.loads((base.ROOT / "samples" / "anna.json").read_text())["faces"]
    points = np.float32([faces[0]["points"]] * 2)
    points *= base.SMALLER
    names = ["portraits/one_neutral.jpg", "portraits/two_neutral.jpg"]
    np.savez(place / "points.npz", names=names, points=points)
    from bakery.heads.file import load_head

    head = load_head("makehuman")
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in head.mean / 1000]
    lines += ["f " + " ".join(str(corner + 1) for corner in face) for face in head.faces]
    (place / "head.obj").write_text("\n".join(lines) + "\n")
