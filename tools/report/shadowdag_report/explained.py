# SPDX-License-Identifier: Apache-2.0
"""The share of errors that the resolution explains, and beside it the null rate: the share of right answers whose reverse
the same test would explain. Explaining proves little where the second is near the first.
"""
UNEXPLAINED = ("unexplained_false_shadow_count", "unexplained_false_light_count")
OTHERS = ("acne_count", "contact_count", "magnified_count")


def wrong_count(row):
    return row["false_shadow_count"] + row["false_light_count"]


def unexplained_count(row):
    return sum(row[key] for key in UNEXPLAINED) if UNEXPLAINED[0] in row else row["unexplained_count"]


def explained_share(row):
    """Returns the share of wrong pairs that are explained by a shift; None without wrong pairs."""
    wrong = wrong_count(row)
    if not wrong:
        return None
    return (wrong - unexplained_count(row) - sum(row.get(key, 0) for key in OTHERS)) / wrong


def null_rate(row):
    """Returns the null rate of right pairs near outlines, where errors lie; None in results without one."""
    return row["outline_null_rate"] if row.get("outline_null_sample_count") else None


def share_text(value):
    return "–" if value is None else f"{100 * value:.1f} %"


def explained_text(row):
    """Returns the explained share, and whether explaining has no power: it would excuse half of the right pairs near outlines, or
    as large a share of them as of the wrong ones."""
    share, null = explained_share(row), null_rate(row)
    return share_text(share) + (", no power" if share is not None and null is not None and (null > 0.5 or share <= null) else "")


def null_text(row):
    """Returns the null rate near outlines and, in brackets, of all right pairs: "81.0 % (12.3 %)"."""
    return f"{share_text(null_rate(row))} ({share_text(row.get('null_rate'))})"
