// SPDX-License-Identifier: Apache-2.0
#include "tools/workspace/build_meter.h"

#include "tools/settings/parse.h"

#include <nlohmann/json.hpp>

#include <sys/resource.h>

#include <cmath>
#include <iostream>

namespace shadowdag {

namespace {

rusage usage() {
    rusage now{};
    getrusage(RUSAGE_SELF, &now);
    return now;
}

double processorSeconds() {
    const rusage now = usage();
    const auto seconds = [](const timeval& t) {
        return double(t.tv_sec) + 1e-6 * double(t.tv_usec);
    };
    return seconds(now.ru_utime) + seconds(now.ru_stime);
}

} // namespace

BuildMeter::BuildMeter()
    : start_(std::chrono::steady_clock::now()), processorStart_(processorSeconds()) {}

void BuildMeter::stop() {
    wallSeconds_ = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    processorSeconds_ = processorSeconds() - processorStart_;
}

void BuildMeter::report(const Console& console, Json& json) const {
    const uint64_t peakBytes = uint64_t(usage().ru_maxrss) * 1024;
    json["wall_s"] = wallSeconds_;
    json["cpu_s"] = processorSeconds_;
    json["peak_rss_bytes"] = peakBytes;
    console.people() << "  time            " << numberText(std::round(wallSeconds_ * 100) / 100)
                     << " s, " << numberText(std::round(processorSeconds_ * 100) / 100)
                     << " s of processor, peak " << bytesText(double(peakBytes)) << "\n";
}

} // namespace shadowdag
