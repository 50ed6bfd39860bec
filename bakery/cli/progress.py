"""How far a long command is: one bar over the whole run, with the time that is left."""

import contextlib
import logging
import math
import os
import sys
import time

log = logging.getLogger(__name__)
WIDTH = 24  # characters of the bar
QUICKEST = 0.1  # seconds between two drawings
SURE = 0.03  # share of the run after which the time left is told


class Progress:
    """A function (step, done, total) that tells how far a run is.

    Args:
        name: what is made, for the bar.
        plan: {step: (seconds, calls)} in order, by the first word of a step's name. Seconds need
            only be in proportion; without a number of calls, done of total counts. An empty plan
            means one step.
        draw: function that shows a line.
    """

    def __init__(self, name="", plan=None, draw=None):
        self.name, self.plan, self.draw = _plain(name), plan or {}, draw
        self.step, self.calls, self.began = None, 0, time.monotonic()
        self.part = (0, 1)  # which of how many runs this is
        self.start = None  # time and share of the first call
        self.drawn = -math.inf

    def __call__(self, step, done, total):
        word, now = step.split(" ")[0], time.monotonic()
        if word != self.step:
            self.end()
            self.step, self.calls, self.began = word, 0, now
            self.drawn = -math.inf
        self.calls += 1
        share = self.share(done, total)
        self.start = self.start or (now, share)
        if self.draw is not None and now - self.drawn >= QUICKEST:
            self.drawn = now
            self.draw(self.line(step, share, now))

    def begin(self, name, number, count):
        """From here on it is run `number` of `count`, from 0; the bar goes over all of them."""
        self.end()
        self.name, self.part = _plain(name), (number, count)

    def end(self):
        """Log how long the step took that ends here."""
        if self.step is not None:
            seconds = time.monotonic() - self.began
            times = f", {self.calls} times" if self.calls > 1 else ""
            log.info("%s: %.1f s%s", self.step, seconds, times)
        self.step = None

    def share(self, done, total):
        """0..1 of all runs."""
        number, count = self.part
        return (number + self._inside(done, total)) / count

    def _inside(self, done, total):
        """0..1 of this run."""
        inside = done / max(total, 1)
        if self.step not in self.plan:
            return min(inside, 1.0)
        seconds, calls = self.plan[self.step]
        if calls:
            inside = (self.calls - 1) / calls
        steps = list(self.plan)
        before = sum(self.plan[step][0] for step in steps[: steps.index(self.step)])
        whole = sum(seconds for seconds, _ in self.plan.values())
        return (before + seconds * min(inside, 1)) / whole

    def line(self, step, share, now):
        """Such as "anna.avatar [######......]  45%  mouth, 12 s left"."""
        bar = ("#" * round(WIDTH * share)).ljust(WIDTH, ".")
        begun, first = self.start
        left = ""
        if share - first > SURE:
            left = f", {span((now - begun) * (1 - share) / (share - first))} left"
        number, count = self.part
        name = f"{self.name} " if self.name else ""
        name = f"[{number + 1}/{count}] {name}" if count > 1 else name
        return f"{name}[{bar}] {100 * share:3.0f}%  {step}{left}"


def _plain(name):
    """As much of a name as one line of a terminal can take."""
    return "".join(c for c in name if c.isprintable())[:24]


def span(seconds):
    """Such as "12 s", "3 min" or "1 h 05 min"."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 90 else f"{minutes // 60} h {minutes % 60:02} min"


def bar_wanted(verbosity):
    """Whether a bar can be drawn: on a terminal that no other bake of `make -j` draws on."""
    alone = "jobserver" not in os.environ.get("MAKEFLAGS", "")
    return verbosity == 0 and alone and sys.stderr.isatty()


@contextlib.contextmanager
def progress(verbosity, name="", plan=None):
    """Progress that draws a bar on a terminal, and with -v logs how long each step took."""

    def draw(line):
        sys.stderr.write(f"\r\x1b[K{line}")
        sys.stderr.flush()

    drawing = bar_wanted(verbosity)
    running = Progress(name, plan, draw if drawing else None)
    try:
        yield running
    finally:
        running.end()
        if drawing:
            draw("")
