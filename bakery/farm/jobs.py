"""A list of bakes as a job that other programs run: Open Job Description, commands, a makefile.

Every task is one `bakery build` of one photo with --skip-fresh, so that an engine may run it again:
a bundle that is there and would come out the same is left as it is.

Source of the format and its limits: Open Job Description, template schemas 2023-09
(github.com/OpenJobDescription/openjd-specifications), sections 1, 2, 3.
"""

import json
import shlex
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from bakery.errors import InputError

RANGE, STEPS, FOLDERS = 1024, 100, 48  # values of a parameter; steps; job parameters less two
PROGRAM, OUT = "bakery", "Bundles"
NOTIFY = 30  # seconds that an engine gives a bake to stop


@dataclass(frozen=True)
class Task:
    """One bake: both paths are absolute."""

    photo: Path
    bundle: Path

    def command(self, arguments: Sequence[str]) -> list[str]:
        """The command line. `arguments` are those of `build` that all tasks share."""
        return [
            PROGRAM,
            "build",
            str(self.photo),
            "-o",
            str(self.bundle),
            "--skip-fresh",
            *arguments,
        ]


@dataclass(frozen=True)
class Job:
    """What is to be baked, and what the tasks share."""

    tasks: Sequence[Task]
    arguments: Sequence[str] = ()  # of `build`
    gibibytes: float = 2.0  # memory of a bake, for engines that place tasks by it
    folder: Path = Path("/")  # absolute; where the job file lies

    def __post_init__(self) -> None:
        for path in (path for task in self.tasks for path in (task.photo, task.bundle)):
            if not str(path).isprintable():
                raise InputError(
                    f"{path}: a job cannot name it; rename it without control characters"
                )


def of_places(
    places: Sequence[tuple[Path, Path]], arguments: Sequence[str], gibibytes: float, folder: Path
) -> Job:
    """The job of some (photo, bundle); relative paths count from the working directory.

    Raises:
        InputError: a path that no job can hold.
    """
    tasks = [Task(photo.absolute(), bundle.absolute()) for photo, bundle in places]
    return Job(tasks, arguments, gibibytes, folder.absolute())


def as_commands(job: Job) -> str:
    """A line for a POSIX shell for each task."""
    return "".join(f"{shlex.join(task.command(job.arguments))}\n" for task in job.tasks)


def as_makefile(job: Job) -> str:
    """A makefile whose targets bake-1, bake-2 ... are the tasks; `make -k -j2` runs them.

    Targets are numbered since make cannot name files with spaces or colons.
    """
    names = [f"bake-{number}" for number in range(1, len(job.tasks) + 1)]
    lines = [f"all: {' '.join(names)}", f".PHONY: all {' '.join(names)}"]
    for name, task in zip(names, job.tasks):
        lines += [f"{name}:", "\t" + shlex.join(task.command(job.arguments)).replace("$", "$$")]
    return "\n".join(lines) + "\n"


def as_openjd(job: Job) -> str:
    """An Open Job Description template as JSON.

    The folders of the photos are job parameters that flow in, the folder of the bundles is one that
    flows out, so that an engine can map or carry them. A step holds up to RANGE tasks. A default
    may only name a place below the template; other places are given when the job is submitted
    (`parameters`).

    Raises:
        InputError: a name that a template cannot hold, or more folders or photos than it holds.
    """
    for text in (*job.arguments, *(str(p) for t in job.tasks for p in (t.photo, t.bundle))):
        if "{{" in text:
            raise InputError(f"{text}: an Open Job Description cannot hold '{{{{'; rename it")
    inside: dict[Path, list[Task]] = {}
    for task in job.tasks:
        inside.setdefault(task.photo.parent, []).append(task)
    steps = [
        _step(f"bake-{number}-{first // RANGE + 1}", f"Photos{number}", tasks[first : first + RANGE], job)
        for number, tasks in enumerate(inside.values(), 1)
        for first in range(0, len(tasks), RANGE)
    ]  # fmt: skip
    if len(inside) > FOLDERS or len(steps) > STEPS:
        raise InputError(
            f"{len(job.tasks)} photos in {len(inside)} folders make {len(steps)} steps; an Open Job "
            f"Description takes {FOLDERS} folders and {STEPS} steps of {RANGE}: write several jobs"
        )
    folders = [
        {
            "name": name,
            "type": "PATH",
            "objectType": "DIRECTORY",
            "dataFlow": "OUT" if name == OUT else "IN",
            **({"default": str(path.relative_to(job.folder))} if _below(path, job) else {}),
        }
        for name, path in _folders(job).items()
    ]
    template = {
        "specificationVersion": "jobtemplate-2023-09",
        "name": f"bakery: {len(job.tasks)} portraits",
        "parameterDefinitions": [
            {"name": "Bakery", "type": "STRING", "default": PROGRAM, "description": "The program."},
            *folders,
        ],
        "steps": steps,
    }
    return json.dumps(template, indent=2, ensure_ascii=False) + "\n"


def parameters(job: Job) -> dict[str, str]:
    """What a template of this job has to be given when it is submitted: folders elsewhere."""
    return {name: str(path) for name, path in _folders(job).items() if not _below(path, job)}


FORMATS: dict[str, Callable[[Job], str]] = {
    "openjd": as_openjd,
    "commands": as_commands,
    "make": as_makefile,
}


def _folders(job: Job) -> dict[str, Path]:
    """The folders of bundles and photos, by the names of their job parameters."""
    photos = dict.fromkeys(task.photo.parent for task in job.tasks)
    named = {f"Photos{number}": path for number, path in enumerate(photos, 1)}
    return {OUT: job.tasks[0].bundle.parent, **named}


def _below(path: Path, job: Job) -> bool:
    return path.is_relative_to(job.folder)


def _step(name: str, folder: str, tasks: list[Task], job: Job) -> dict[str, object]:
    """Tasks of one folder: photo and bundle go through their names side by side."""
    photo, bundle = "{{Task.Param.Photo}}", "{{Task.Param.Bundle}}"
    command = ["build", f"{{{{Param.{folder}}}}}/{photo}", "-o", f"{{{{Param.{OUT}}}}}/{bundle}"]
    return {
        "name": name,
        "parameterSpace": {
            "taskParameterDefinitions": [
                {"name": "Photo", "type": "STRING", "range": [t.photo.name for t in tasks]},
                {"name": "Bundle", "type": "STRING", "range": [t.bundle.name for t in tasks]},
            ],
            "combination": "(Photo, Bundle)",
        },
        "hostRequirements": {
            "amounts": [
                {"name": "amount.worker.vcpu", "min": 1},
                {"name": "amount.worker.memory", "min": round(job.gibibytes * 1024)},  # MiB
            ]
        },
        "script": {
            "actions": {
                "onRun": {
                    "command": "{{Param.Bakery}}",
                    "args": [*command, "--skip-fresh", *job.arguments],
                    "cancelation": {
                        "mode": "NOTIFY_THEN_TERMINATE",
                        "notifyPeriodInSeconds": NOTIFY,
                    },
                }
            }
        },
    }
