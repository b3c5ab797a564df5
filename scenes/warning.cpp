// SPDX-License-Identifier: Apache-2.0
#include "scenes/warning.h"

#include <atomic>
#include <cstdio>

namespace shadowdag {

namespace {

std::atomic<void (*)(const std::string&)> warningListener{nullptr};

} // namespace

void setWarningListener(void (*listener)(const std::string& text)) {
    warningListener = listener;
}

void warn(const std::string& text) {
    if (void (*const listener)(const std::string&) = warningListener.load())
        listener(text);
    else
        std::fprintf(stderr, "warning: %s\n", text.c_str());
}

} // namespace shadowdag
