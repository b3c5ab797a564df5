// SPDX-License-Identifier: Apache-2.0
#include "gl/device_choice.h"

#include "cuda/error.h"

namespace shadowdag {

bool GlDeviceChoice::open(const std::vector<Candidate>& candidates, std::string& why) {
    std::string missing = "; it no longer exists";
    for (const Candidate& candidate : candidates) {
        if (!chosen_.empty() && candidate.name != chosen_)
            continue;
        std::string said;
        if (candidate.open(said)) {
            chosen_ = candidate.name;
            return true;
        }
        why += said;
        missing = said;
    }
    if (chosen_.empty())
        return false;
    throw Error(ErrorKind::kDevice,
                "OpenGL ran on EGL's " + chosen_ + " before, which can no longer be opened" +
                    missing + "; no other device is used instead: restart, or use --backend cpu");
}

} // namespace shadowdag
