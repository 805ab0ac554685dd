#!/bin/bash
# §shards_word§ of §scenario§, and what puts them together when all are done. Submit both with
#   bash THIS-FILE
# and, after `standstill status §shards§` named shards to submit again, with
#   bash THIS-FILE --array=3,7-9
# Other options are handed on to sbatch, for the shards and for what puts them together. Shards go on where they ended; those that are
# done end at once.
§directives§set -eu
standstill=§program§
shards=§shards§

if [ -n "${SLURM_ARRAY_TASK_ID:-}" ]; then
    # Behind the script's name: how many shards are before those of this array.
    shard=$((SLURM_ARRAY_TASK_ID + ${1:-0}))
    exec "$standstill" §command§ --threads §cpus§ --resume --out "$shards" --shard "$shard/§count§"
fi

if ! command -v sbatch >/dev/null; then
    echo "sbatch is not here: run this where jobs are submitted to Slurm" >&2
    exit 2
fi
script=$(realpath "$0")
array=1-§count§
more=()
while [ $# -gt 0 ]; do
    case $1 in
        --array=*) array=${1#--array=} ;;
        --array | -a) array=${2:?"$1: which shards?"}; shift ;;
        -a*) array=${1#-a} ;;
        *) more+=("$1") ;;
    esac
    shift
done
# The numbers of an array are at most §block§ (MaxArraySize of Slurm, unless a cluster sets another): shard §example§ is number 3 of the
# array that has §block§ shards before it.
limit=
case $array in *%*) limit=%${array#*%}; array=${array%%%*} ;; esac
arrays=()
IFS=, read -ra parts <<<"$array"
for part in "${parts[@]}"; do
    if ! [[ $part =~ ^([0-9]{1,7})(-([0-9]{1,7})(:([1-9][0-9]{0,6}))?)?$ ]]; then
        echo "--array: found '$part', needed shards such as 3,7-9" >&2
        exit 2
    fi
    from=$((10#${BASH_REMATCH[1]})) last=$((10#${BASH_REMATCH[3]:-$from})) step=$((10#${BASH_REMATCH[5]:-1}))
    if [ "$from" -lt 1 ] || [ "$last" -gt §count§ ] || [ "$from" -gt "$last" ]; then
        echo "--array: found '$part', needed shards from 1 to §count§" >&2
        exit 2
    fi
    while [ "$from" -le "$last" ]; do
        of=$(((from - 1) / §block§)) end=$last
        [ "$end" -le $(((of + 1) * §block§)) ] || end=$(((of + 1) * §block§))
        end=$((from + (end - from) / step * step))
        words=$((from - of * §block§))
        if [ "$end" -gt "$from" ]; then
            words=$words-$((end - of * §block§))
            [ "$step" = 1 ] || words=$words:$step
        fi
        arrays[of]=${arrays[of]:+${arrays[of]},}$words
        from=$((end + step))
    done
done
cd §here§
mkdir -p "$shards"
jobs=
for of in "${!arrays[@]}"; do
    job=$(sbatch --parsable --output="$shards/%A_%a.log" --array="${arrays[of]}$limit" ${more[@]+"${more[@]}"} "$script" $((of * §block§)))
    jobs=$jobs:${job%%;*}
done
merge=$(sbatch --parsable§merge_partition§ ${more[@]+"${more[@]}"} --job-name=§name§-merge --output="$shards/merge.log" \
    --dependency="afterok$jobs" --kill-on-invalid-dep=yes \
    --wrap="exec $(printf '%q ' "$standstill" merge "$shards" --out §out§§format§)")
jobs=${jobs#:}
echo "submitted: shards as job ${jobs//:/, }, and job ${merge%%;*} to put them together in §out_plain§"
