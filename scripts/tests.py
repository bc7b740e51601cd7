#!/usr/bin/env python3
"""Runs all tests, several programs side by side, and says what took how long.

    scripts/tests.py [--full] [--jobs N] [WORDS]...

Builds the tests as `cargo test --release` does. Those of one module run in one process, one after the other, so that they share its
device; as many processes run at a time as the machine has cores, and one more, since some of them wait. What took long the last
time begins first. A test that fails ends nothing but itself. WORDS choose tests whose name holds one of them, `--full` adds those
that are marked as long. The last line is `N passed, N failed, N skipped`, where skipped are those not chosen by `--full` and those
that said that this machine lacks what they need. Needs nothing but Python 3.9.
"""

import argparse
import atexit
import collections
import contextlib
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
TABLE = ROOT / "docs/TESTING.md"
# A process that is silent for so long hangs: the longest test takes minutes.
PATIENCE_S = 3600
# Free memory that temporary folders may be made in.
MEMORY_FOLDER_BYTES = 8 << 30
# What tests report beside their result (tests/support/report.rs).
PARTS = ["compilation", "rendering", "reference", "program"]
# What libtest prints when a test begins, and at its end.
NAME = re.compile(r"^test (\S+) \.\.\. ", re.MULTILINE)
RESULT = re.compile(r"^(ok|FAILED)$", re.MULTILINE)


class Test:
    def __init__(self, name):
        self.name = name
        self.result = None  # "ok", "failed", "skipped"
        self.seconds = 0.0
        self.parts = collections.Counter()
        self.notes = []


class Job:
    """The tests of a module of one program, or a program that is a test by itself."""

    def __init__(self, subject, executable, tests, harness):
        self.subject, self.executable, self.tests, self.harness = subject, executable, tests, harness


def build():
    """Builds the tests; the programs as (name, path, whether they know about tests by name)."""
    command = ["cargo", "test", "--release", "--locked", "--no-run", "--message-format=json-render-diagnostics"]
    cargo = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True)
    if cargo.returncode != 0:
        sys.exit(cargo.returncode)
    programs = []
    for line in cargo.stdout.splitlines():
        message = json.loads(line)
        if message["reason"] == "compiler-artifact" and message["profile"]["test"] and message["executable"]:
            target = message["target"]
            programs.append((target["name"], target["kind"][0], message["executable"]))
    return programs


def names(executable, *options):
    listed = subprocess.run([executable, "--list", "--format", "terse", *options], cwd=ROOT, capture_output=True, text=True)
    listed.check_returncode()
    return [line[: -len(": test")] for line in listed.stdout.splitlines() if line.endswith(": test")]


def plan(programs, words, full):
    """The jobs, and the tests that are not run."""
    jobs, left_out = [], []
    for name, kind, executable in programs:
        if kind == "bench":
            test = Test(f"benches::{name}")
            if not words or any(word in test.name for word in words):
                jobs.append(Job("benches", executable, [test], harness=False))
            continue
        long = set(names(executable, "--ignored"))
        modules = collections.defaultdict(list)
        for test in names(executable):
            if words and not any(word in test for word in words):
                continue
            if test in long and not full:
                left_out.append(test)
                continue
            modules[test.rpartition("::")[0]].append(Test(test))
        for module, tests in modules.items():
            subject = module if kind == "test" and name == "all" else f"{name}::{module}".rstrip(":")
            jobs.append(Job(subject, executable, tests, harness=True))
    return jobs, left_out


def remembered():
    """Seconds of subjects, from the table in docs/TESTING.md."""
    rows = re.findall(r"^\| `([\w:]+)` \| \d+ \| ([\d.]+) \|", TABLE.read_text(), re.MULTILINE)
    return {subject: float(seconds) for subject, seconds in rows}


class Printer:
    """Lines of several threads, one at a time."""

    def __init__(self):
        self.lock = threading.Lock()

    def __call__(self, text):
        with self.lock:
            print(text, flush=True)


say = Printer()
# Whether to say how much of the standard error that they may have tests use.
verbose = False
# Whether tests make all of their proofs.
full = False


def told(test):
    """What a test took and took it for, in words."""
    parts = [f"{part} {test.parts[part]:.1f}" for part in PARTS if test.parts[part] >= 0.05]
    return f"{test.seconds:7.1f} s  {', '.join(parts)}".rstrip()


# The folder that temporary folders are made in, where this program has made it: the only one that it may remove.
own_folder = None


def remove_own_folder():
    if own_folder:
        shutil.rmtree(own_folder, ignore_errors=True)


class Process(subprocess.Popen):
    """A program of tests, and whatever it starts: a render that its test did not live to end is ended with it."""

    all, lock = set(), threading.Lock()

    def __init__(self, command, **options):
        with Process.lock:
            super().__init__(command, cwd=ROOT, stdin=subprocess.DEVNULL, start_new_session=True, **options)
            Process.all.add(self)

    def end(self):
        with Process.lock:
            # Once: its number may be another's later.
            if self in Process.all:
                Process.all.remove(self)
                with contextlib.suppress(ProcessLookupError):
                    os.killpg(self.pid, signal.SIGKILL)

    @staticmethod
    def end_all(number, _frame):
        for process in list(Process.all):
            process.end()
        remove_own_folder()
        # The threads that wait for them are not waited for.
        os._exit(128 + number)


def run_by_name(job, output, report):
    """Runs the tests of a job in one process, and in another what that one took with it when it died."""
    left = collections.OrderedDict((test.name, test) for test in job.tests)
    while left:
        command = [job.executable, "--exact", "--test-threads=1", "--include-ignored", *left]
        environment = dict(os.environ, SPECTILE_TEST_REPORT=report.name)
        if full:
            environment["SPECTILE_FULL"] = "1"
        errors = tempfile.TemporaryFile("w+", errors="replace")
        process = Process(command, stdout=subprocess.PIPE, stderr=errors, env=environment)
        hung = threading.Timer(PATIENCE_S, process.end)
        hung.start()
        # With one thread a name comes when its test begins, and its result when it ends.
        current, began, text = None, time.monotonic(), ""
        while read := process.stdout.read1(1 << 16).decode(errors="replace"):
            output.append(read)
            text += read
            while match := (RESULT if current else NAME).search(text):
                text = text[match.end() :]
                if current is None:
                    current, began = left.get(match[1]), time.monotonic()
                    continue
                current.seconds, current.result = time.monotonic() - began, {"ok": "ok", "FAILED": "failed"}[match[1]]
                finish(current, report)
                del left[current.name]
                current = None
        process.wait()
        hung.cancel()
        process.end()
        errors.seek(0)
        output.append(errors.read())
        if not left:
            return
        # It died, or never knew them.
        died = current or next(iter(left.values()))
        died.result, died.seconds = "failed", time.monotonic() - began
        output.append(f"\n{died.name}: its process ended with {process.returncode}\n")
        finish(died, report)
        del left[died.name]


def run_alone(job, output, report):
    [test] = job.tests
    began = time.monotonic()
    process = Process([job.executable], stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    output.append(process.communicate()[0].decode(errors="replace"))
    process.end()
    test.seconds, test.result = time.monotonic() - began, "ok" if process.returncode == 0 else "failed"
    finish(test, report)


def finish(test, report):
    """Adds what the test reported, and says how it went."""
    report.seek(0)
    for line in report.read().splitlines():
        name, what, value = line.split("\t", 2)
        if name == test.name and what in PARTS:
            test.parts[what] += float(value)
        elif name == test.name and (what != "resolution" or verbose):
            test.notes.append(value)
            if what == "skipped" and test.result == "ok":
                test.result = "skipped"
    notes = "".join(f"\n{'':22}{note}" for note in dict.fromkeys(test.notes))
    say(f"{test.result:>8} {told(test):<14} {test.name}{notes}")


def run(jobs, at_once):
    """Runs the jobs, the longest first; what the failed ones printed."""
    seconds = remembered()
    waiting = collections.deque(sorted(jobs, key=lambda job: -seconds.get(job.subject, 1e9)))
    failures, lock = [], threading.Lock()

    def work():
        while True:
            with lock:
                if not waiting:
                    return
                job = waiting.popleft()
            output = []
            with tempfile.NamedTemporaryFile("r", prefix="spectile-test-") as report:
                (run_by_name if job.harness else run_alone)(job, output, report)
            if any(test.result == "failed" for test in job.tests):
                with lock:
                    failures.append((job.subject, "".join(output)))

    threads = [threading.Thread(target=work) for _ in range(at_once)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return failures


def table(jobs):
    """The rows of docs/TESTING.md: seconds by subject."""
    rows = collections.defaultdict(lambda: [0, 0.0, collections.Counter()])
    for job in jobs:
        row = rows[job.subject]
        for test in job.tests:
            row[0] += 1
            row[1] += test.seconds
            row[2].update(test.parts)
    lines = [f"| subject | tests | seconds | {' | '.join(PARTS)} |", "| --- " * (3 + len(PARTS)) + "|"]
    for subject, (count, seconds, parts) in sorted(rows.items(), key=lambda row: -row[1][1]):
        cells = " | ".join(f"{parts[part]:.1f}" if parts[part] >= 0.05 else "" for part in PARTS)
        lines.append(f"| `{subject}` | {count} | {seconds:.1f} | {cells} |")
    return lines


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--full", action="store_true")
    parser.add_argument("--jobs", type=int, default=(os.cpu_count() or 1) + 1)
    parser.add_argument("--verbose", action="store_true", help="also how much of its allowed standard error a test uses")
    parser.add_argument("--failed", action="append", default=[], help="another check that failed, to be counted")
    parser.add_argument("words", nargs="*")
    arguments = parser.parse_args()
    global verbose, full, own_folder
    verbose, full = arguments.verbose, arguments.full

    # Tests of what is safe on a disk wait for it a hundred times longer than they work.
    memory = pathlib.Path("/dev/shm")
    if "TMPDIR" not in os.environ and memory.is_dir() and shutil.disk_usage(memory).free > MEMORY_FOLDER_BYTES:
        own_folder = tempfile.tempdir = os.environ["TMPDIR"] = tempfile.mkdtemp(prefix="spectile-tests-", dir=memory)
        atexit.register(remove_own_folder)

    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, Process.end_all)
    began = time.monotonic()
    programs = build()
    built = time.monotonic()
    jobs, left_out = plan(programs, arguments.words, arguments.full)
    failures = run(jobs, arguments.jobs)
    ended = time.monotonic()

    for subject, output in failures:
        say(f"\n==== {subject}\n{output}")
    say("\n" + "\n".join(table(jobs)))
    results = collections.Counter(test.result for job in jobs for test in job.tests)
    for job in jobs:
        for test in job.tests:
            if test.result == "failed":
                say(f"failed: {test.name}")
    for name in arguments.failed:
        say(f"failed: {name}")
    results["failed"] += len(arguments.failed)
    say(f"{built - began:.0f} s to build the tests, {ended - built:.0f} s to run them")
    skipped = results["skipped"] + len(left_out)
    say(f"{results['ok']} passed, {results['failed']} failed" + (f", {skipped} skipped" if skipped else ""))
    sys.exit(results["failed"] > 0)


if __name__ == "__main__":
    main()
