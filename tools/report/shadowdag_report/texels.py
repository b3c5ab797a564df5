# SPDX-License-Identifier: Apache-2.0
"""The paper's threshold in texels, and its equivalent for pictures of another size."""
import math

PAPER_TEXELS = 96
PAPER_PIXELS = 1920 * 1080


def equivalent_texels(experiment):
    width, height = (int(part) for part in experiment["size"].split("x"))
    return PAPER_TEXELS * math.sqrt(width * height / PAPER_PIXELS)
