#!/usr/bin/env python3
"""What the sweep driver costs a run, and what a second job gains.

    tests/bench/sweep/sweep_bench.py BINARY

Best of three rounds, both sides in each round. The overhead is the wall time of a sweep of short
runs with one job, less that of the same commands given one after the other, by run.
"""
import os
import shutil
import subprocess
import sys
import tempfile
import time

SOURCE = os.path.abspath(os.path.join(os.path.dirname(__file__), "../../.."))
ROUNDS = 3


def sweep_file(folder, name, seeds, settings):
    path = os.path.join(folder, name + ".yaml")
    with open(path, "w") as f:
        f.write(f"base: {SOURCE}/scenarios/inflation.yaml\nset:\n")
        f.writelines(f"  {key}: {value}\n" for key, value in settings.items())
        f.write(f"seeds: 1..{seeds}\n")
    return path


def timed(command, **kwargs):
    begin = time.perf_counter()
    subprocess.run(command, check=False, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                   **kwargs)
    return time.perf_counter() - begin


def sweep(binary, path, out, jobs):
    return timed([binary, "sweep", path, "--out", out, "--jobs", str(jobs)])


def one_by_one(binary, out):
    plans = sorted(os.listdir(os.path.join(out, "plan")))
    return sum(timed([binary, "run", f"plan/{p}", "--name", "inflation", "--out", f"bare/{p[:-5]}",
                      "--threads", "1", "--quiet"], cwd=out) for p in plans)


def main():
    binary = os.path.abspath(sys.argv[1])
    folder = tempfile.mkdtemp(prefix="arex-bench-")
    short = {"mission.max_time_s": 0.2, "lidar.enabled": "false", "odometry.source": "mocap",
             "mapping.use_depth": "false"}
    runs = 24
    path = sweep_file(folder, "short", runs, short)
    overheads = []
    for i in range(ROUNDS):
        out = os.path.join(folder, f"short{i}")
        driven = sweep(binary, path, out, 1)
        bare = one_by_one(binary, out)
        overheads.append((driven - bare) / runs)
        print(f"  {runs} runs: {driven:.2f} s in a sweep, {bare:.2f} s one by one")
    print(f"driver's overhead, ms a run                  {1e3 * min(overheads):.1f}")

    path = sweep_file(folder, "long", 8, {"mission.max_time_s": 12})
    gains = []
    for i in range(ROUNDS):
        one = sweep(binary, path, os.path.join(folder, f"one{i}"), 1)
        two = sweep(binary, path, os.path.join(folder, f"two{i}"), 2)
        gains.append(one / two)
        print(f"  8 flights of 12 s: {one:.2f} s with one job, {two:.2f} s with two")
    print(f"throughput of two jobs over one              {max(gains):.2f}")
    shutil.rmtree(folder)


if __name__ == "__main__":
    main()
