# SPDX-License-Identifier: Apache-2.0
"""The colours of charts and pages: Okabe and Ito's, which colour-blind readers tell apart. No chart needs them alone:
markers, dashes and hatches distinguish its series too.
"""
BLACK, ORANGE, SKY, GREEN, YELLOW, BLUE, VERMILION, PURPLE = (
    "#000000", "#E69F00", "#56B4E9", "#009E73", "#F0E442", "#0072B2", "#D55E00", "#CC79A7")
GREY = "#8a9099"
