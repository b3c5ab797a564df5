# SPDX-License-Identifier: Apache-2.0
"""Numbers on axes: plain digits, and the ticks of logarithmic axes. For charts by matplotlib and for those of pages."""
import decimal
import math


def plain(value, _=None):
    """1000 as 1000, 0.05 as 0.05: no powers where plain digits are read faster."""
    if value == 0:
        return "0"
    if value >= 10000:
        return f"{value:,.0f}".replace(",", "\u2009")
    if abs(value) < 1e-4:
        return f"{decimal.Decimal(f'{value:.3g}'):f}"
    return f"{value:.0f}" if value >= 10 and value == round(value) or value >= 100 else f"{value:.3g}"


def log_ticks(low, high, ticks=(1, 2, 5), near=(1, 1.5, 2, 3, 4, 5, 7)):
    """Returns the ticks of a logarithmic axis: 1, 2, 5 (fewer if it spans many decades, `near` if it spans about one; at most six,
    from among more, if it spans less)."""
    def places(ticks):
        powers = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
        return [m * 10.0 ** e for e in powers for m in ticks if low <= m * 10.0 ** e <= high]

    decades = math.log10(high / low)
    if decades > 0.6:
        return places((1,) if decades > 3 else (1, 3) if decades > 2 else ticks if decades >= 1.3 else near)
    fine = places((1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 7, 8, 9))
    return fine if len(fine) <= 6 else places((1, 1.5, 2, 3, 4, 5, 7))
