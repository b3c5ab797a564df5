# SPDX-License-Identifier: Apache-2.0
"""Pages: each command reads the data of a directory and writes its index.html."""
