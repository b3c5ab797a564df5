// SPDX-License-Identifier: Apache-2.0
#include "tools/settings/words.h"

namespace shadowdag {

std::string countText(uint64_t count, const std::string& unit) {
    return std::to_string(count) + " " + unit + (count == 1 ? "" : "s");
}

std::string orText(const std::vector<std::string>& names) {
    std::string text;
    for (size_t i = 0; i < names.size(); ++i)
        text += (i == 0 ? "" : i + 1 < names.size() ? ", " : " or ") + names[i];
    return text;
}

} // namespace shadowdag
