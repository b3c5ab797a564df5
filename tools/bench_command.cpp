// SPDX-License-Identifier: Apache-2.0
// `shadowdag bench`: placeholder until benches land.
#include "tools/commands.h"
namespace shadowdag {
std::function<void()> declareBench(CommandLine&) { return [] {}; }
}
