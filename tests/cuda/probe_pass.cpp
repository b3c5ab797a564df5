// SPDX-License-Identifier: Apache-2.0
#include "tests/cuda/probe_pass.h"

#include "cuda/pass_launch.h"

SDAG_PASS(Probe)
