# SPDX-License-Identifier: Apache-2.0
"""Measures committed results anew and says what got worse: counts only, which depend on no machine.

    results.py PROGRAM [NAME...]      NAME as in tests/bench/results, without .json; none: what takes seconds

Ends with 5 if `shadowdag diff` finds something worse or missing in one of them, with 1 for a name that is not listed, and with the
program's status where it cannot measure. `./do results` builds the program and runs this.
"""
import json
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
RESULTS = ROOT / "tests/bench/results"
WORSE = 5
SIZE = ("--size", "640x360")


def compare(experiment, *more):
    return ("compare", "--experiment", f"scenes/experiments/{experiment}.json", *more, "--no-charts")


def study(kind):
    return ("study", kind)


def bench(part, scene):
    return ("bench", part, scene, *SIZE, "--repeats", "1", "--json")


# By name: the command; one that prints JSON has --json, of any other the output is a directory. Without the study of mutants,
# which needs a build with assertions, what times alone make, and scenes of others.
QUICK = {"small": compare("small"), "bench-raster-atrium": bench("raster", "builtin:atrium")}
LONGER = ({f"bench-raster-{scene}": bench("raster", f"builtin:{scene}") for scene in ("houses", "necropolis")}
          | {f"bench-shading-{scene}": bench("shading", f"builtin:{scene}") for scene in ("atrium", "houses", "necropolis")}
          | {"compare-atrium": compare("atrium"), "stability": study("stability"),
             "mechanisms": study("ablation"), "adjudication": study("adjudication"), "scale": study("scale")}
          | {f"validate-{scene}-{name}": ("validate", f"builtin:{scene}", *SIZE, *options, "--json")
             for scene in ("atrium", "houses", "necropolis") for name, options in (
                 ("dag-none", ("--believe", "none")), ("dag-all", ("--believe", "all", "--resolution", "4096")),
                 ("maps", ("--method", "maps")))})


def timed_once(experiment, directory):
    """Returns a copy of an experiment's file that renders every frame once for its time: no option may contradict the file."""
    path = pathlib.Path(ROOT, experiment)
    copy = pathlib.Path(directory) / path.name
    copy.write_text(json.dumps(json.loads(path.read_text()) | {"repeats": 1, "warmups": 0}))
    return str(copy)


def measure(program, command, directory):
    """Runs a command; returns its status and the file or directory of its results."""
    command = [timed_once(word, directory) if before == "--experiment" else word for before, word in zip(("", *command), command)]
    if command[-1] != "--json":
        output = pathlib.Path(directory) / "report"
        return subprocess.run([program, *command, "-o", output], cwd=ROOT, check=False).returncode, output
    output = pathlib.Path(directory) / "results.json"
    with open(output, "wb") as file:
        return subprocess.run([program, *command], cwd=ROOT, stdout=file, check=False).returncode, output


def main(program, names):
    recipes = QUICK | LONGER
    unknown = [name for name in names if name not in recipes]
    if unknown:
        print(f"results: {', '.join(unknown)}: unknown; known are {', '.join(recipes)}", file=sys.stderr)
        return 1
    worse = []
    for name in names or QUICK:
        print(f"results: {name}", flush=True)
        with tempfile.TemporaryDirectory() as directory:
            status, measured = measure(program, recipes[name], directory)
            if status not in (0, WORSE):  # a study that found a bound that does not hold has its results, too
                return status
            found = subprocess.run([program, "diff", RESULTS / f"{name}.json", measured, "--no-times"], cwd=ROOT, check=False).returncode
        if found not in (0, WORSE):
            return found
        worse += [name] * (found == WORSE)
    print(f"results: {len(names or QUICK)} measured anew, worse: {', '.join(worse) or 'none'}")
    return WORSE if worse else 0


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    sys.exit(main(str(pathlib.Path(sys.argv[1]).resolve()), sys.argv[2:]))
