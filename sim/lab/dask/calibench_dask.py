"""A study spread over the machines of a Dask cluster: the bytes of one run, whatever happens to the workers.

    calibench_dask.py SCENARIO --trials N -o OUT.csv [--scheduler ADDRESS | --workers W] [--shard N] [--check N]

A shard is some trials in a row, carried out by `calibench sim study --first K --trials N` on whatever worker is free. A worker that is lost costs the
shard in its hands, which another takes. Shards are kept in OUT.csv.shards as they come, so that a study that was cut goes on where it was, and
are put together by `calibench sim merge`. The workers need the program, and the scenario with what it extends, where --program and SCENARIO say.

Ends with 1 when a shard fails or a check does not hold, with 2 when it is called wrongly.
"""

import argparse
import os
import random
import subprocess
import sys
import tempfile
from pathlib import Path

from distributed import Client, LocalCluster, as_completed


def shard(program, scenario, options, first, trials):
    """The table of the trials `first` to `first + trials - 1`, and who made it. Runs on a worker."""
    with tempfile.TemporaryDirectory(prefix="calibench-") as folder:
        table = Path(folder) / "shard.csv"
        command = [program, "sim", "study", scenario, "--first", str(first), "--trials", str(trials), "--output", str(table), "--json", *options]
        # A Dask worker is a core; the program shall not take the others'.
        done = subprocess.run(command, capture_output=True, text=True, env={**os.environ, "RAYON_NUM_THREADS": "1"})
        if done.returncode != 0:
            raise RuntimeError(f"trials {first} to {first + trials - 1}: {done.stderr.strip()}")
        return table.read_bytes(), os.getpid()


def kept(folder, first, trials):
    return folder / f"{first:012}-{trials}.csv"


def write_whole(path, table):
    """A file appears whole or not at all."""
    beside = path.with_suffix(".partial")
    with open(beside, "wb") as file:
        file.write(table)
        file.flush()
        os.fsync(file.fileno())
    beside.replace(path)


def gather(client, arguments, shards, folder):
    """Has every shard made that is not there yet; the processes that made them."""
    wanted = [at for at in shards if not kept(folder, *at).exists()]
    common = (arguments.program, str(arguments.scenario), arguments.options)
    # The same call gives the same bytes: whoever is lost is replaced, as often as that happens.
    futures = {client.submit(shard, *common, *at, pure=False, retries=arguments.retries): at for at in wanted}
    makers, failed = set(), None
    for future in as_completed(futures):
        if future.status != "finished":
            failed = failed or future.exception()
            continue
        table, maker = future.result()
        write_whole(kept(folder, *futures[future]), table)
        makers.add(maker)
        future.release()
        print(f"{sum(kept(folder, *at).exists() for at in shards)} of {len(shards)} shards", file=sys.stderr, flush=True)
    if failed:
        raise failed
    return makers


def checked(arguments, shards, folder):
    """Has some shards made once more, here: whether their bytes are the same."""
    for at in random.Random(0).sample(shards, min(arguments.check, len(shards))):
        table, _ = shard(arguments.program, str(arguments.scenario), arguments.options, *at)
        if table != kept(folder, *at).read_bytes():
            print(f"trials {at[0]} to {at[0] + at[1] - 1} come out otherwise on this machine than where they were made", file=sys.stderr)
            return False
    return True


def positive(text):
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError("is to be 1 or more")
    return value


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenario", type=Path)
    parser.add_argument("--trials", type=positive, required=True)
    parser.add_argument("-o", "--output", type=Path, required=True, help="the table (CSV); one that is there is replaced")
    parser.add_argument("--scheduler", help="address of a Dask scheduler; without it, workers on this machine")
    parser.add_argument("--workers", type=positive, default=os.cpu_count(), help="workers on this machine")
    parser.add_argument("--shard", type=positive, default=1000, help="trials of a shard")
    parser.add_argument("--retries", type=int, default=2, help="how often a shard that fails is tried again")
    parser.add_argument("--check", type=int, default=1, help="so many shards are made once more and compared")
    parser.add_argument("--program", default="calibench", help="the program, on every worker")
    parser.add_argument("options", nargs="*", help="behind --: further options of `sim study`, as --seed 2")
    arguments = parser.parse_args()
    arguments.scenario = arguments.scenario.resolve()
    if not arguments.scenario.is_file():
        parser.error(f"{arguments.scenario} is not there")
    folder = arguments.output.with_name(arguments.output.name + ".shards")
    folder.mkdir(parents=True, exist_ok=True)
    n = arguments.trials
    shards = [(first, min(arguments.shard, n - first)) for first in range(0, n, arguments.shard)]
    try:
        if arguments.scheduler:
            with Client(arguments.scheduler) as client:
                makers = gather(client, arguments, shards, folder)
        else:
            # Loopback only, and no page: a study opens nothing to the network.
            with LocalCluster(n_workers=arguments.workers, threads_per_worker=1, host="127.0.0.1", dashboard_address=None) as cluster, Client(cluster) as client:
                makers = gather(client, arguments, shards, folder)
        if not checked(arguments, shards, folder):
            return 1
        command = [arguments.program, "sim", "merge", *(str(kept(folder, *at)) for at in shards), "--output", str(arguments.output)]
        merged = subprocess.run(command, capture_output=True, text=True)
        if merged.returncode != 0:
            raise RuntimeError(merged.stderr.strip())
    except (RuntimeError, OSError) as failure:
        print(f"{Path(sys.argv[0]).name}: {failure}; what was done is kept in {folder}", file=sys.stderr)
        return 1
    print(merged.stdout, end="")
    print(f"{n} trials in {len(shards)} shards by {len(makers)} processes, in {arguments.output}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
