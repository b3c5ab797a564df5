// SPDX-License-Identifier: Apache-2.0
// Punctual lights: light_leaf.h, which shaders compile too.
#pragma once

#include "scenes/light_leaf.h"
