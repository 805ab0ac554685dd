"""A run on Dask's workers, one of which is killed half way: the statistics are those of the run on one machine.

    python examples/python/dask_shards.py

Each shard is a task. Its journal is in a folder that all workers see; a task that is run again, because its worker was
lost, goes on where the journal ends.
"""

import os
import signal
import tempfile

from dask.distributed import Client, LocalCluster, as_completed

import standstill as st

SHARDS = 12
SCENARIO = """
trials = 24_000
[detector]
method = "bipolar"
[axes]
"errors" = ["default", "harsh"]
"""


def part(index: int, folder: str) -> tuple[int, int]:
    """One shard, and the process that computed it."""
    st.shard(SCENARIO, f"{index}/{SHARDS}", out=folder, rows="none", threads=1, progress=False)
    return index, os.getpid()


def main() -> None:
    with tempfile.TemporaryDirectory() as folder, LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=None
    ) as cluster, Client(cluster) as client:
        workers = client.run(os.getpid)
        print(f"workers: {sorted(workers.values())}")
        tasks = [client.submit(part, index, folder, retries=3, pure=False) for index in range(1, SHARDS + 1)]
        done: dict[int, int] = {}
        killed = 0
        for task in as_completed(tasks):
            index, process = task.result()
            done[index] = process
            if len(done) == 3 and not killed:
                killed = sorted(workers.values())[0]
                print(f"{len(done)} of {SHARDS} shards are done; worker {killed} is killed")
                os.kill(killed, signal.SIGKILL)
        # What a lost worker had done is in its journals, whether Dask asks for it again or not.
        status = st.status([folder])
        print(f"shards: {status['counts']}")
        merged = st.merge([folder])
    single = st.run(SCENARIO, progress=False)
    assert killed and killed not in {process for index, process in done.items() if index > SHARDS // 2 + 3}
    assert status["counts"]["done"] == SHARDS
    assert merged.summary == single.summary and merged.points == single.points
    for point in merged.points:
        rms, trials = point["summary"]["rms_deg"]["value"], point["summary"]["trials"]
        print(f"{point['values']['errors']} errors: rms {rms:.4f}° from {trials} trials, as on one machine")


if __name__ == "__main__":
    main()

