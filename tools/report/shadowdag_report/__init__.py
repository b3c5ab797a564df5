# SPDX-License-Identifier: Apache-2.0
"""Charts and pages from the data that `shadowdag` writes: `python3 -m shadowdag_report COMMAND`."""
