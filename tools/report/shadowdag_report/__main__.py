# SPDX-License-Identifier: Apache-2.0
"""The package's command line: one command per page or chart; each module of COMMANDS has declare(parser) and run(arguments).

    python3 -m shadowdag_report COMMAND [ARGUMENT...]     or     python3 DIR/shadowdag_report COMMAND [ARGUMENT...]

Exit status: 0 done, 1 wrong usage or a missing package, 3 the data are insufficient, 4 a file cannot be written.
Errors are one line on standard error.
"""
import argparse
import errno
import importlib
import os
import signal
import sys

sys.dont_write_bytecode = True  # an installed program leaves no files beside itself
if not __package__:  # started as a directory: make it a package
    sys.path[0] = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))

from shadowdag_report.files import Refused  # noqa: E402

USAGE, REFUSED, UNWRITTEN = 1, 3, 4
PACKAGES = {"matplotlib": "python3-matplotlib", "numpy": "python3-matplotlib", "jinja2": "python3-jinja2"}
REMEDIES = {errno.ENOSPC: "free space there or choose another directory",
            errno.EFBIG: "raise the limit of the shell on the size of files (ulimit -f)"}
COMMANDS = {  # name: (module, what it does)
    "compare": ("pages.compare", "the page and charts of shadowdag compare"),
    "failures": ("pages.failures", "the page of shadowdag study failures"),
    "stability": ("pages.stability", "the page and charts of shadowdag study stability"),
    "real": ("pages.real", "the page of shadowdag study real"),
    "ablation": ("pages.mechanisms", "the page and chart of shadowdag study ablation"),
    "mechanisms": ("pages.mechanisms", "the same of results of its earlier name"),
    "charts": ("charts", "only the charts of shadowdag compare"),
    "figures": ("figures", "the paper's figures of shadowdag compare --sequence"),
    "stability-charts": ("charts.stability", "only the charts of shadowdag study stability"),
    "mechanisms-chart": ("charts.mechanisms", "only the chart of shadowdag study ablation"),
    "fit": ("pages.fit", "the page and chart of shadowdag fit"),
    "diff": ("pages.diff", "the page of shadowdag diff"),
    "single": ("single", "a page with its pictures and charts in one file"),
    "regret": ("charts.regret", "what routing loses against the oracle"),
    "bias": ("charts.bias", "what the bias of a map's lookup gives and costs"),
    "layouts": ("charts.layouts", "bytes against ray rate of the voxels' layouts"),
    "frame": ("charts.frame", "what a pair costs in a whole frame, beside Embree"),
    "main": ("charts.main", "error against time in many scenes and sizes"),
    "committed": ("committed", "the charts of docs/, from the committed results, or a check of them"),
    "mutants": ("pages.mutants", "the page of shadowdag study mutants"),
    "adjudication": ("pages.adjudication", "the page of shadowdag study adjudication"),
    "adjudicated": ("adjudicated", "the tables of verdicts in docs/adjudicator.md"),
    "scale": ("pages.scale", "the page and charts of shadowdag study scale"),
    "scale-chart": ("charts.scale", "only the charts of shadowdag study scale"),
    "tracers": ("pages.tracers", "the page of shadowdag rays"),
    "mutation": ("mutation", "the table of faults in docs/mutants.md"),
    "determinism": ("determinism", "the table of determinism in docs/promises.md"),
    "fuzzing": ("fuzzing", "the table of fuzzing in docs/promises.md"),
    "faults": ("faults", "the table of faults in docs/promises.md"),
    "device": ("device", "the tables of a GPU in docs/results.md"),
    "claims": ("claims", "the tables of measured claims in docs/results.md"),
}


def parser_of(name, module):
    parser = argparse.ArgumentParser(prog=f"shadowdag_report {name}", description=module.__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    module.declare(parser)
    return parser


def set_stamp(name, arguments):
    """Stamps the charts of a command with its data and drawing; pages and tables have none."""
    from shadowdag_report.stamp import MODULES, stamp_of_arguments
    if name in MODULES:
        from shadowdag_report import collection
        collection.STAMP = stamp_of_arguments(name, arguments)


def usage():
    width = max(map(len, COMMANDS))
    return "usage: shadowdag_report COMMAND [ARGUMENT...]\n\n" + "\n".join(
        f"  {name:<{width}}  {what}" for name, (_, what) in COMMANDS.items()) + "\n"


def main(arguments):
    """Runs a command; returns the exit status."""
    if arguments[:1] in ([], ["-h"], ["--help"]) or arguments[0] not in COMMANDS:
        print(usage(), end="", file=sys.stdout if arguments[:1] in (["-h"], ["--help"]) else sys.stderr)
        return 0 if arguments[:1] in (["-h"], ["--help"]) else USAGE
    name = arguments[0]

    def end(status, message):
        print(f"{name}: " + " ".join(str(message).splitlines()), file=sys.stderr)
        return status

    try:
        module = importlib.import_module("shadowdag_report." + COMMANDS[name][0])
        parsed = parser_of(name, module).parse_args(arguments[1:])
        set_stamp(name, arguments[1:])
        module.run(parsed)
    except ModuleNotFoundError as missing:
        package = PACKAGES.get((missing.name or "").split(".")[0])
        if package is None:
            raise
        return end(USAGE, f"needs the Python module {missing.name}: apt-get install {package}")
    except Refused as refusal:
        return end(REFUSED, refusal)
    except RecursionError:
        return end(REFUSED, "the results are nested too deep; measure again")
    except OSError as error:
        remedy = REMEDIES.get(error.errno, "choose another directory")
        return end(UNWRITTEN, f"{error.filename or 'output'}: cannot be written: {error.strerror or error}; {remedy}")
    return 0


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, lambda number, _: sys.exit(128 + number))  # so that no partial file remains
    sys.exit(main(sys.argv[1:]))
