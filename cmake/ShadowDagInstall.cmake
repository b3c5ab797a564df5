# SPDX-License-Identifier: Apache-2.0
# Installation; filled below.
