"""Cases and runs, Ctrl-C among them; the command."""

import errno
import json
import os
import pickle
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import anisobond as ab
from conftest import SHORT_WAVE


def test_a_run_and_its_tables(wave, tmp_path):
    beats = []
    run = ab.run(wave, tmp_path / "wave", progress=lambda *beat: beats.append(beat))
    probes = run.probes()
    assert len(probes) > 3 and probes["time_s"][-1] == pytest.approx(8e-6, rel=2e-2)
    assert beats[-1][0] == beats[-1][1] == run.to_dict()["steps"]
    assert {"summary.json", "probes.csv"} <= {f.name for f in run.files} and run.cracks() is None
    again = ab.open_run(tmp_path / "wave")
    assert again.to_dict() == json.loads((tmp_path / "wave/summary.json").read_text())
    np.testing.assert_array_equal(again.probes()["time_s"], probes["time_s"])
    assert str(again) == str(run) and repr(again) == repr(run) and again.to_dict() == run.to_dict()
    # It is finished: nothing says that it could be gone on with.
    for resume in (False, True):
        with pytest.raises(ab.Error, match="already has results of a run, and it is finished") as caught:
            ab.run(wave, tmp_path / "wave", resume=resume)
        assert "resume" not in str(caught.value) and "another folder" in str(caught.value)


def test_an_interrupted_run_goes_on(tmp_path):
    def interrupt(done, total, message):
        if done < total:
            raise KeyboardInterrupt

    # Slower than the 50 ms between words of progress.
    case = ab.Case(repository_wave(), set={"body.box.max": "400, 8, 8 mm", "output.frames": 2})
    with pytest.raises(ab.Interrupted, match="is done and kept.*resume=True"):
        ab.run(case, tmp_path / "slow", progress=interrupt)
    run = ab.run(case, tmp_path / "slow", resume=True)
    assert run.probes()["time_s"][-1] == pytest.approx(60e-6, rel=2e-2)


def repository_wave():
    """The shipped case."""
    from conftest import REPOSITORY

    return REPOSITORY / "cases/wave.toml"


# A shell that runs the tests in the background has its programs ignore Ctrl-C; those below hear it anyway.
HEARS_CTRL_C = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"


def test_ctrl_c_keeps_a_checkpoint_and_resuming_makes_the_same_probes(tmp_path):
    program = (
        f"{HEARS_CTRL_C}import sys, anisobond as ab\n"
        f"case = ab.Case({str(repository_wave())!r}, set={{'body.box.max': '400, 6, 6 mm', 'motion.duration': '240 us', 'output.frames': 0}})\n"
        "ab.run(case, sys.argv[1], resume=len(sys.argv) > 2, progress=lambda *b: print('beat', flush=True))\n"
    )
    words = [sys.executable, "-c", program]
    child = subprocess.Popen([*words, str(tmp_path / "a")], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert child.stdout.readline().strip() == "beat"
    child.send_signal(signal.SIGINT)
    _, said = child.communicate(timeout=60)
    assert child.returncode != 0 and "Interrupted: interrupted: step" in said, said
    subprocess.run([*words, str(tmp_path / "a"), "resume"], check=True, capture_output=True)
    subprocess.run([*words, str(tmp_path / "b")], check=True, capture_output=True)
    assert (tmp_path / "a/probes.csv").read_bytes() == (tmp_path / "b/probes.csv").read_bytes()


def test_ctrl_c_ends_a_correction_and_its_threads():
    program = (
        f"{HEARS_CTRL_C}import time, anisobond as ab\n"
        "p = ab.Packing.crystal('fcc', radius='1 mm', cells=(12, 12, 12), perturb=0.1)\n"
        "try:\n"
        "    ab.element_test(p, 'Pyroceram', contact_radius=1.6, correct=True, progress=lambda *b: print(*b, flush=True))\n"
        "except ab.Interrupted as error:\n"
        "    begun = time.process_time()\n"  # Of all threads.
        "    time.sleep(0.5)\n"
        "    print('over', time.process_time() - begun, error, flush=True)\n"
    )
    child = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True)
    counts = []
    for line in child.stdout:
        done, total, message = line.rstrip("\n").split(" ", 2)
        counts.append(int(done))
        if message.startswith("correction 1, error "):
            break
    child.send_signal(signal.SIGINT)
    said, _ = child.communicate(timeout=60)
    assert total == "0" and counts == sorted(counts) and counts[-1] > 0
    word, cpu, text = said.strip().splitlines()[-1].split(" ", 2)
    assert word == "over" and float(cpu) < 0.1, said
    assert text.startswith("interrupted: the element test was not finished (correction 1, error "), said


def ticks_within_a_call(work):
    """The most that another thread counts while `work` is called once: one or two if it never gives the lock away."""
    import threading

    count, done = 0, threading.Event()

    def tick():
        nonlocal count
        while not done.is_set():
            count += 1
            time.sleep(0.0001)

    thread = threading.Thread(target=tick)
    thread.start()
    most = 0
    for _ in range(100):
        before = count
        work()
        most = max(most, count - before)
        if most > 20:
            break
    done.set()
    thread.join()
    return most


def test_the_lock_is_released_while_work_lasts(packing):
    """Each of these was a pause as long as itself; now another thread gets the lock meanwhile."""
    c, n = ab.Stiffness("KIO3"), np.random.default_rng(0).normal(size=(200_000, 3))
    hole = ab.Cavity(c, radius=1, pressure=1)
    for work in (
        lambda: ab.element_test(packing, "Pyroceram", contact_radius=1.6),
        lambda: c.waves(n, density=1000),
        lambda: ab.Neighbourhood(horizon=60),
        lambda: hole.displacement(n),
    ):
        assert ticks_within_a_call(work) > 20


def command(*words, **more):
    """The installed command, or the module where it is not on the path."""
    program = os.path.join(os.path.dirname(sys.executable), "anisobond")
    return subprocess.run([program, *words], capture_output=True, text=True, **more)


def test_the_command_is_installed():
    assert "anisobond" in command("--version").stdout
    assert command("calibrate", "Si", "--require-exact").returncode == 3
    wrong = command("tensor", "KIO4")
    assert wrong.returncode == 2
    with pytest.raises(ab.Error) as caught:
        ab.Stiffness("KIO4")
    assert wrong.stderr.strip() == f"anisobond: {caught.value}"


def test_ctrl_c_of_the_command(tmp_path):
    program = os.path.join(os.path.dirname(sys.executable), "anisobond")
    sets = ["--set", "body.box.max=400, 8, 8 mm", "--set", "motion.duration=1 ms"]
    words = [program, "run", str(repository_wave()), *sets, "-o", str(tmp_path / "w")]
    child = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    for _ in range(1200):
        time.sleep(0.05)
        if (tmp_path / "w/probes.csv").exists():
            break
    time.sleep(0.3)
    child.send_signal(signal.SIGINT)
    _, said = child.communicate(timeout=60)
    assert child.returncode == 130 and "interrupted: step" in said


@pytest.mark.parametrize(
    ("make", "fragments"),
    [
        (lambda: ab.Case("/nowhere.toml"), ["/nowhere.toml"]),
        (lambda: ab.Case("nam = 1\n"), ["case.toml", "name"]),
        (lambda: ab.Case(repository_wave(), set={"grid.spacin": 1}), ["spacing"]),
        (lambda: ab.run(repository_wave(), "/tmp/never", resume=True), ["no checkpoint"]),
        (lambda: ab.open_run("/nowhere"), ["/nowhere"]),
        (lambda: ab.verify("prakas"), ["prakash"]),
        (lambda: ab.Case("a = 1\n", set={"b": float("nan")}), ["b is nan"]),
        (lambda: ab.run(repository_wave(), "/tmp/never", progress=3), ["progress"]),
    ],
)
def test_wrong_input_says_what_to_do(make, fragments):
    with pytest.raises(ab.Error) as caught:
        make()
    assert all(f in str(caught.value) for f in fragments), caught.value


def test_cases_are_pickled_and_shown():
    case = ab.Case(ab.Case.starter("bar"), set={"grid.spacing": "10 mm", "output.frames": np.int64(2)})
    again = pickle.loads(pickle.dumps(case))
    assert again.to_dict() == case.to_dict() and again.to_dict()["set"] == {"grid.spacing": "10 mm", "output.frames": "2"}
    assert again.check().to_dict()["nodes"] == case.check().to_dict()["nodes"] and "bar" in case._repr_html_()
    of_file = pickle.loads(pickle.dumps(ab.Case(repository_wave(), set=SHORT_WAVE)))
    assert of_file.to_dict()["file"].endswith("wave.toml") and of_file.name == "wave"


def test_the_module_is_the_command():
    words = [sys.executable, "-m", "anisobond", "--version"]
    assert "anisobond" in subprocess.run(words, capture_output=True, text=True, check=True).stdout


def test_files_are_files_errors_too(tmp_path):
    with pytest.raises(OSError):
        ab.open_run("/nowhere")
    for make, name in ((ab.Case, "case.toml"), (ab.Packing.read, "p.txt"), (lambda path: ab.open_run(path.parent), "summary.json")):
        with pytest.raises(FileNotFoundError) as caught:
            make(tmp_path / name)
        assert caught.value.errno == errno.ENOENT and caught.value.filename == str(tmp_path / name)
        assert isinstance(caught.value, ab.FileError) and str(caught.value).startswith("cannot read")
        assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)
        assert caught.value.kind == pickle.loads(pickle.dumps(caught.value)).kind == "file"
    assert issubclass(ab.Interrupted, KeyboardInterrupt) and not issubclass(ab.Interrupted, Exception)


def test_errors_say_for_programs_what_they_are():
    def kind(work):
        with pytest.raises(ab.Error) as caught:
            work()
        assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)
        assert pickle.loads(pickle.dumps(caught.value)).kind == caught.value.kind
        return caught.value.kind

    packing = ab.Packing([[0, 0, 0], [1, 1, 1]], [0.1, 0.1], cell=[10, 10, 10])
    assert kind(lambda: ab.calibrate("Si", horizon=0.5)) == "input"
    assert kind(lambda: ab.element_test(packing, "Si", contact_radius=1.0)) == "mechanism"
    assert kind(lambda: ab.calibrate("KIO3", horizon=3, require_exact=True)) == "not-exact"
    assert ab.Interrupted().kind == "interrupted"
