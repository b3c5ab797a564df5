# SPDX-License-Identifier: Apache-2.0
"""Medians with their intervals, as results have them, and as text.

Newer results state the interval of a median by order statistics (`_low`, `_high`, `_confidence`). Of older ones the least
and the greatest of n values are known, which hold the median with 1 - 2^(1 - n).
"""
import math

CONFIDENCE = 0.95
LEAST_ROUNDS = 6  # whose least and greatest ratio hold the median with 95 %


def interval(row, key="time_ms"):
    """Returns (low, high, confidence) of a measured value; the value itself and 0 if nothing else is known."""
    if f"{key}_low" in row:
        return row[f"{key}_low"], row[f"{key}_high"], row.get(f"{key}_confidence", 0.0)
    if f"{key}_min" in row:
        return row[f"{key}_min"], row[f"{key}_max"], 1 - 2.0 ** (1 - max(1, row.get("repeat_count", 1)))
    return row[key], row[key], 0.0


def half_widths(row, key="time_ms"):
    """Returns how far the interval reaches below and above the value, for error bars."""
    low, high, _ = interval(row, key)
    return max(0.0, row[key] - low), max(0.0, high - row[key])


def confidence_text(confidence):
    """Returns "95 %" for all that hold at least that, else what they hold, rounded down."""
    return "95 %" if confidence >= CONFIDENCE else f"{int(100 * confidence)} %"


def ends_text(row, key="time_ms", decimals=0):
    """Returns "159 to 214", with the confidence where the values were too few for 95 %."""
    low, high, confidence = interval(row, key)
    return f"{low:.{decimals}f} to {high:.{decimals}f}" + ("" if confidence >= CONFIDENCE else f", {confidence_text(confidence)}")


def interval_text(row, key="time_ms", decimals=0):
    """Returns "172 (159 to 214)", with the confidence where the values were too few for 95 %."""
    return f"{row[key]:.{decimals}f} ({ends_text(row, key, decimals)})"


def pair_time(method, repeat_count):
    """Returns the time of a pair by a method of a whole frame, with its interval and repeat_count. Older results state the interval
    of the CPU time alone, of which it is the same share.

    repeat_count: of the bench, for results whose methods state none
    """
    timed = {"repeat_count": repeat_count} | method
    if "ns_per_pair_low" not in timed and "ns_per_pair_min" not in timed:
        low, high, confidence = interval(timed, "cpu_s")
        scale = method["ns_per_pair"] / method["cpu_s"]
        timed |= {"ns_per_pair_low": low * scale, "ns_per_pair_high": high * scale, "ns_per_pair_confidence": confidence}
    return timed


def least_confidence(rows, key="time_ms"):
    return min((interval(row, key)[2] for row in rows), default=0.0)


def paired_ratios(run, base):
    """Returns the ratios of two times in the same rounds, ascending; none where the rounds are not known."""
    of, to = run.get("round_times_ms", ()), base.get("round_times_ms", ())
    return sorted(a / b for a, b in zip(of, to)) if len(of) == len(to) else []


def median_interval(ordered):
    """Returns what the median of ascending values is at least and at most: by order statistics, with 95 % unless they are fewer than
    LEAST_ROUNDS."""
    count = len(ordered)
    cut, beyond = 0, 2.0 ** -count  # of a fair coin thrown so often: no more than `cut` heads
    while 2 * (beyond + math.comb(count, cut + 1) * 2.0 ** -count) <= 1 - CONFIDENCE + 1e-12:
        cut += 1
        beyond += math.comb(count, cut) * 2.0 ** -count
    return ordered[cut], ordered[count - 1 - cut]


def are_apart(a, b, key="time_ms"):
    """Returns whether the intervals of two rows are disjoint."""
    (a_low, a_high, _), (b_low, b_high, _) = interval(a, key), interval(b, key)
    return a_high < b_low or b_high < a_low
