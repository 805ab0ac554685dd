#!/usr/bin/env bash
# The shards of a run as a job array of Slurm, with a controller on this machine alone: one task is killed half way, the
# script is submitted again for what `status` names, and the merged files have the bytes of a single run.
#   tests/cluster/slurm.sh path/to/standstill
# Needs slurmctld, slurmd, munged (Debian: slurm-wlm) and root. Ends with 77 where they are not there.
set -euo pipefail
standstill=$(realpath "$1")
root=$(realpath "$(dirname "$0")/../..")
for program in slurmctld slurmd munged sbatch; do
    if ! command -v "$program" >/dev/null; then
        echo "$program is not here: the part with Slurm was left out (Debian: apt-get install slurm-wlm)"
        exit 77
    fi
done
if [ "$(id -u)" != 0 ]; then
    echo "slurmd starts jobs as other users and needs root: the part with Slurm was left out"
    exit 77
fi

folder=$(mktemp -d)
daemons=()
finish() {
    for daemon in "${daemons[@]}"; do kill "$daemon" 2>/dev/null || true; done
    wait
    rm -rf "$folder"
}
trap finish EXIT
cd "$folder"
mkdir state spool
head -c 1024 /dev/urandom >munge.key
chmod 700 . && chmod 600 munge.key
host=$(hostname -s)
export SLURM_CONF=$folder/slurm.conf
cat >slurm.conf <<END
ClusterName=standstill
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=16817
SlurmdPort=16818
AuthType=auth/munge
AuthInfo=socket=$folder/munge.socket
SlurmUser=root
SlurmdUser=root
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/slurmd.pid
SlurmctldLogFile=$folder/slurmctld.log
SlurmdLogFile=$folder/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerParameters=sched_interval=1,bf_interval=1
ReturnToService=2
NodeName=$host NodeAddr=127.0.0.1 CPUs=$(nproc) State=UNKNOWN
PartitionName=short Nodes=ALL Default=YES MaxTime=INFINITE State=UP
END
munged --foreground --force 2>/dev/null --key-file=munge.key --socket="$folder/munge.socket" --pid-file="$folder/munge.pid" \
    --log-file="$folder/munge.log" --seed-file="$folder/munge.seed" &
daemons+=($!)
for _ in $(seq 50); do [ -S munge.socket ] && break; sleep 0.1; done
slurmctld -D >/dev/null 2>&1 &
daemons+=($!)
slurmd -D -N "$host" >/dev/null 2>&1 &
daemons+=($!)
for _ in $(seq 100); do sinfo -h -o %t 2>/dev/null | grep -q idle && break; sleep 0.2; done
sinfo -h -o %t | grep -q idle || { cat slurmctld.log slurmd.log; exit 1; }

say() { printf '\n$ %s\n' "$*"; }
none_left() { for _ in $(seq 600); do [ -z "$(squeue -h)" ] && return; sleep 0.2; done; squeue; exit 1; }
cat >campaign.toml <<'END'
trials = 20000
[detector]
method = "bipolar"
[axes]
"errors" = ["default", "harsh"]
END
"$standstill" run campaign.toml --out single >/dev/null

say "standstill slurm campaign.toml --shards 4 --partition short --time 01:00:00 --out results > campaign.sh"
"$standstill" slurm campaign.toml --shards 4 --partition short --time 01:00:00 --out results >campaign.sh
say "bash campaign.sh"
bash campaign.sh
# The second task is killed once it has begun.
for _ in $(seq 600); do
    [ -s results/shards/shard-2-of-4.journal ] && [ "$(stat -c %s results/shards/shard-2-of-4.journal)" -gt 20000 ] && break
    sleep 0.05
done
job=$(squeue -h -r -n campaign -o %A | head -1)
first=$(squeue -h -r -o %F | sort -n | head -1)
say "scancel --signal=KILL ${first}_2"
scancel --signal=KILL "${first}_2"
none_left
say "standstill status results/shards"
if "$standstill" status results/shards; then
    echo "the killed shard came to its end before (job $job): nothing was tried" >&2
    exit 1
fi
[ ! -e results/summary.json ] || { echo "merged although a shard is missing" >&2; exit 1; }
array=$("$standstill" status --json results/shards | python3 -c 'import json, sys; print(json.load(sys.stdin)["array"])' || true)
say "bash campaign.sh --array=$array"
bash campaign.sh "--array=$array"
none_left
say "standstill status results/shards"
"$standstill" status results/shards
cat results/shards/merge.log
cmp single/trials.csv results/trials.csv
cmp single/summary.json results/summary.json
echo "trials.csv and summary.json have the bytes of the single run"

# The commands with which the page begins, as printed, each after the jobs of the one before.
mkdir bin page && ln -s "$standstill" bin/standstill && cd page
cp ../campaign.toml .
while IFS= read -r line; do
    say "$line"
    code=0
    PATH=$folder/bin:$PATH bash -c "$line" || code=$?
    # `status` ends with 1 while shards are missing.
    case "$code:$line" in 0:* | "1:standstill status"*) ;; *) exit 1 ;; esac
    none_left
done < <("$root/scripts/run-page.sh" "$root/docs/cluster.md" --print)
cmp ../single/trials.csv results/trials.csv
echo "the commands of docs/cluster.md ran as printed"
