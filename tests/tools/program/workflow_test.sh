#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Runs the workflow with two local jobs and a tiny scene: workflow_test.sh PROGRAM SOURCE_DIR
# Exit status 77 is "skipped".
set -euo pipefail
program=$1 source=$2
command -v snakemake >/dev/null || {
    echo "SKIPPED: there is no snakemake; ./do packages installs it"
    exit 77
}
stage=$(mktemp -d)
trap 'rm -rf -- "$stage"' EXIT
cd -- "$stage"
export HOME=$stage XDG_CACHE_HOME=$stage/cache

fail() {
    printf 'FAILED: %s\n' "$*" >&2
    tail -n 40 -- ./*.log results/logs/*/*.log >&2 2>/dev/null || true
    exit 1
}

# The program, but the first merge and the first part of a sweep are killed at their work.
cat >program.sh <<END
#!/usr/bin/env bash
echo "\$@" >>"$stage/calls"
case "\$*" in
    merge*) victim=merge seconds=0.005 ;;
    *"--part 1/2"*--resume*) victim=part seconds=1 ;;
    *) exec "$program" "\$@" ;;
esac
if [[ ! -e "$stage/killed-\$victim" ]]; then
    touch "$stage/killed-\$victim"
    timeout -s KILL \$seconds "$program" "\$@" || true
    kill -KILL \$\$
fi
exec "$program" "\$@"
END
chmod +x program.sh
cat >experiment.json <<END
{"scenes": ["builtin:fail-mover"], "size": "64x36", "frames": "0:1", "lights": -1, "resolutions": [64],
 "methods": ["embree", "dag", "maps"], "thresholds": [0, "inf"], "models": [], "repeats": 1, "warmups": 0}
END
cat >config.yaml <<END
program: $stage/program.sh
threads: 1
charts: false
assets:
  mover: {scene: "builtin:fail-mover", resolution: 64, parts: 3}
sweeps:
  tiny: {experiment: experiment.json, parts: 2, voxels: [mover]}
END
run() {
    snakemake --snakefile "$source/workflow/Snakefile" --configfile config.yaml --nocolor --rerun-incomplete "$@"
}

# Two jobs at a time, each step killed once: snakemake reports it, and nothing looks finished.
for attempt in 1 2 3; do
    run --jobs 2 --resources timing=1 >"attempt-$attempt.log" 2>&1 && break
    [[ $attempt == 3 ]] && fail "two killed jobs are not made up for by two more runs"
    [[ -e results/sweeps/tiny/results.json ]] && fail "a report without its parts"
    [[ $attempt == 1 && -e results/assets/mover.svdag ]] && fail "a killed merge left an asset"
done
((attempt > 1)) || fail "the killed merge went unnoticed"
[[ $(grep -c '^voxelize' calls) == 3 ]] || fail "finished parts were built again"
[[ -e killed-merge && -e killed-part ]] || fail "nothing was killed"

"$program" voxelize builtin:fail-mover --resolution 64 -o single.svdag >single.log 2>&1
cmp single.svdag results/assets/mover.svdag || fail "the merged asset is not the single one"

# The report is that of one compare, but for times and machines.
"$program" compare --experiment experiment.json --voxels results/assets/mover.svdag --no-charts -o single >single.log 2>&1
python3 - single/results.json results/sweeps/tiny/results.json <<'END' || fail "the joined report differs"
import json, sys
def load(path):
    results = json.load(open(path))
    for key in ("thread_count", "parts"):
        results["provenance"].pop(key, None)
    results.pop("verdict")  # of times
    for entry in results["runs"] + results["map_costs"]:
        for key in list(entry):
            if key.startswith("time_") or "_ms" in key or key in ("rays_scale", "maps_scale", "whole_frame",
                                                                  "other_cpu_share", "shown_as"):
                del entry[key]
    return results
a, b = (load(path) for path in sys.argv[1:])
assert len(a["runs"]) == 6, len(a["runs"])
sys.exit(a != b)
END

# Nothing is left to do.
run --jobs 2 --dry-run >dry.log 2>&1 || fail "a dry run"
grep -q "Nothing to be done" dry.log || fail "a second run would do something"

# Another experiment, while leavings of killed jobs lie about: the same command makes the report anew.
sed -i 's/"frames": "0:1"/"frames": "0:2"/' experiment.json
mkdir -p results/sweeps/tiny.parts/{1of2,2of2}/partial results/sweeps/tiny/partial
echo '{"key": "another", "parts": {}}' >results/sweeps/tiny.parts/1of2/partial/journal.json
touch results/sweeps/tiny.parts/2of2/partial/costs.json results/sweeps/tiny/partial/results.csv
run --jobs 2 --resources timing=1 >again.log 2>&1 || fail "a changed experiment does not run"
[[ $(python3 -c 'import json, sys; print(len(json.load(open(sys.argv[1]))["runs"]))' results/sweeps/tiny/results.json) == 9 ]] ||
    fail "the report is that of the older experiment"
[[ ! -e results/sweeps/tiny/partial ]] || fail "leavings of a killed join stay"

# Another program makes everything anew.
echo "# changed" >>program.sh
run --jobs 2 --dry-run >program.log 2>&1 || fail "a dry run"
grep -q '^voxelize_part  *3' program.log || fail "another program builds nothing anew"

# The cluster's profile, with a stub for sbatch: what it submits runs.
mkdir bin
cat >bin/sbatch <<END
#!/usr/bin/env bash
echo "\$@" >>"$stage/submitted"
bash "\${@: -1}" >/dev/null 2>&1 &
echo \$\$
END
chmod +x bin/sbatch
rm -rf results
sed -i "s|^program:.*|program: $program|" config.yaml
# With CI=true snakemake looks at jobs every second, else every ten.
CI=true PATH=$stage/bin:$PATH run --profile "$source/workflow/slurm" --latency-wait 5 >slurm.log 2>&1 || fail "the stub cluster"
cmp single.svdag results/assets/mover.svdag || fail "the asset from the stub cluster is not the single one"
[[ $(grep -c -- '--exclusive' submitted) == 2 ]] || fail "timed jobs must have their machine to themselves"
grep -q -- '--cpus-per-task=1 --mem=4000M --time=120' submitted || fail "what is asked of the cluster"

# What is wrong in the configuration is named.
sed -i 's/parts: 3/parts: none/' config.yaml
run --jobs 2 --dry-run >wrong.log 2>&1 && fail "a wrong number of parts is taken"
grep -q "the asset 'mover': parts is 'none'" wrong.log || fail "what is wrong with the parts is not said"
echo "the workflow behaves"
