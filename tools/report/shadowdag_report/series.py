# SPDX-License-Identifier: Apache-2.0
"""Which runs of compare belong together: rays by what they believe, sweeps over thresholds, the front."""
import math
import statistics

from .intervals import LEAST_ROUNDS, interval, median_interval, paired_ratios

TIE = 0.03  # kVerdictTie of tools/report/verdict.h


def threshold_of(run):
    value = run["parameters"].get("threshold_texels")
    return None if value is None else math.inf if value == "inf" else float(value)


def label_of(run):
    """Returns the label of a run as it is shown; run["label"] identifies it. Both differ for model oracle where it is not the
    fastest (tools/report/verdict.h, nameMeasuredRoutes)."""
    return run.get("shown_as", run)["label"]


def model_of(run):
    """Returns the cost model of a run as it is shown."""
    return run.get("shown_as", run)["model"]


def legend_of_names(runs):
    """Explains what is shown by another name, as a sentence after a space; "" if nothing is."""
    reasons = dict.fromkeys(run["shown_as"]["why"] for run in runs if "shown_as" in run)
    return "".join(f" {reason[:1].upper()}{reason[1:]}." for reason in reasons)


def believe_of(run):
    """Returns which voxels the rays of a run believe: "all", "none", or a number of pixels."""
    return run["parameters"].get("believe", "all")


def is_warm(run):
    """Returns whether a run is of frames whose maps or beams a frame of the same view left."""
    return run.get("parameters", {}).get("start") == "warm"


def keeps_beams(run):
    """Returns whether the exact rays of a run keep beams."""
    return run["parameters"].get("beam_bytes", 0) > 0


def rays_alone(runs, believe):
    """Returns the runs of rays alone, without beams, that believe "all", "none" or (None) anything between."""
    return [r for r in runs if r["method"] == "dag" and not keeps_beams(r) and
            (believe_of(r) == believe if believe else believe_of(r) not in ("all", "none"))]


def tracers_of(runs):
    """Returns the rows of `shadowdag rays`: tracers that answered the pairs of a frame outside of it."""
    return [r for r in runs if r["method"] == "tracer"]


def settings_of(run):
    """Returns what distinguishes the run from others of its sweep: all parameters but the threshold."""
    return {key: value for key, value in run["parameters"].items() if key != "threshold_texels"}


def sweeps(runs):
    """Returns the threshold sweeps: {series key: runs ascending in threshold}.

    The pure methods are members of every sweep that agrees with all parameters that they read.
    """
    series = {}
    for run in runs:
        if run["method"] == "hybrid" and threshold_of(run) is not None:
            series.setdefault(tuple(settings_of(run).items()), []).append(run)
    for key, members in series.items():
        members += [r for r in runs if r["method"] in ("dag", "maps") and settings_of(r).items() <= dict(key).items()]
        members.sort(key=threshold_of)
    return series


def series_name(key, all_keys):
    """Returns the text that distinguishes a series from the others; "" if there is none."""
    names = {"resolution": "{}³", "undersample": "u{}", "page_size": "pages {}", "taps": "{} taps", "start": "{}"}
    others = [dict(other) for other in all_keys]
    return ", ".join(names.get(k, k.replace("_", " ") + " {}").format(v) for k, v in key
                     if any(k in other and other[k] != v for other in others))


def is_faster(a, b):
    """Returns whether a run is faster than another, as the verdict has it (tools/report/verdict.cpp): in the same rounds, by TIE and
    with the whole interval of the ratio; without enough rounds by more than half of the larger interval of both."""
    ratios = paired_ratios(a, b)
    if len(ratios) >= LEAST_ROUNDS:
        return statistics.median(ratios) <= 1 - TIE and median_interval(ratios)[1] < 1
    widths = [high - low for low, high, _ in map(interval, (a, b))]
    return a["time_ms"] + 0.5 * max(widths) < b["time_ms"]


def pareto(runs):
    """Returns the runs, ascending in time, that no other dominates: none has a smaller error without being slower by
    more than the spread of the times, and none of equal error is faster."""
    front = [r for i, r in enumerate(runs) if not any(
        other["error"] < r["error"] and not is_faster(r, other) or
        other["error"] == r["error"] and (other["time_ms"], j) < (r["time_ms"], i) for j, other in enumerate(runs))]
    return sorted(front, key=lambda r: r["time_ms"])
