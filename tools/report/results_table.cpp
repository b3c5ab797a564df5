// SPDX-License-Identifier: Apache-2.0
#include "tools/report/results_table.h"

#include "cuda/quantile_interval.h"
#include "tools/report/sequence_times.h"
#include "tools/workspace/frame_json.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iomanip>
#include <string>
#include <utility>
#include <vector>

namespace shadowdag {

namespace {

constexpr const char* kIntervalHeading = "95 % interval";
constexpr int kIntervalWidth = 26; // "1234.5 to 1234.5 (75 %)" and a space before it

/// Returns the width of a column that begins with these names.
template <class Names> int widthOf(const Names& names, int least) {
    size_t longest = size_t(least) - 2;
    for (const std::string& name : names)
        longest = std::max(longest, name.size());
    return int(longest) + 2;
}

} // namespace

std::string intervalText(const Json& of, const std::string& key) {
    if (!of.contains(key + "_low"))
        return "-";
    char text[80];
    const double confidence = of.at(key + "_confidence");
    const double low = of.at(key + "_low"), high = of.at(key + "_high");
    const int decimals = high < 10 ? 2 : 1;
    std::snprintf(text, sizeof text, "%.*f to %.*f", decimals, low, decimals, high);
    std::string interval = text;
    if (confidence < kConfidence) { // too few values
        std::snprintf(text, sizeof text, " (%.0f %%)", std::floor(100 * confidence));
        interval += text;
    }
    return interval;
}

void printSequences(std::ostream& out, const Json& rows) {
    if (rows.empty())
        return;
    struct Sum {
        double triangles = 0, texels = 0, pairs = 0, wrong = 0, answers = 0, flickers = 0;
    };
    const Json times = sequenceTimes(rows); // in the order of first appearance, as sums
    std::vector<std::pair<std::string, Sum>> sums;
    for (const Json& row : rows) {
        const std::string name =
            row.at("scene").get<std::string>() + ", " + row.at("label").get<std::string>();
        auto found = std::find_if(sums.begin(), sums.end(),
                                  [&](const auto& sum) { return sum.first == name; });
        if (found == sums.end())
            found = sums.insert(sums.end(), {name, {}});
        Sum& sum = found->second;
        const auto value = [&](const char* key) { return row.at(key).get<double>(); };
        sum.triangles = std::max(sum.triangles, value("triangle_draw_count"));
        sum.texels = std::max(sum.texels, value("texel_count"));
        sum.pairs += value("pair_count");
        sum.wrong += value("false_shadow_count") + value("false_light_count");
        sum.answers += value("flicker_answer_count");
        sum.flickers += value("flicker_count");
    }
    std::vector<std::string> names;
    for (const auto& [name, sum] : sums)
        names.push_back(name);
    const int nameWidth = widthOf(names, 24);
    out << std::left << std::setw(nameWidth) << "sequence" << std::right << std::setw(10)
        << "median ms" << std::setw(kIntervalWidth) << kIntervalHeading << std::setw(10)
        << "99 % ms" << std::setw(kIntervalWidth) << kIntervalHeading << std::setw(7) << "n"
        << std::setw(16) << "peak triangles" << std::setw(14) << "peak texels" << std::setw(9)
        << "wrong" << std::setw(11) << "flicker"
        << "\n"
        << std::fixed;
    for (size_t i = 0; i < sums.size(); ++i) {
        const auto& [name, sum] = sums[i];
        out << std::left << std::setw(nameWidth) << name << std::right << std::setprecision(2)
            << std::setw(10) << times[i]["time_ms"].get<double>() << std::setw(kIntervalWidth)
            << intervalText(times[i], "time_ms") << std::setw(10)
            << times[i]["time_ms_p99"].get<double>() << std::setw(kIntervalWidth)
            << intervalText(times[i], "time_ms_p99") << std::setw(7)
            << times[i]["value_count"].get<uint64_t>() << std::setprecision(0) << std::setw(16)
            << sum.triangles << std::setw(14) << sum.texels << std::setprecision(2) << std::setw(7)
            << 100 * sum.wrong / std::max(1.0, sum.pairs) << " %" << std::setprecision(4)
            << std::setw(9) << 100 * sum.flickers / std::max(1.0, sum.answers) << " %\n";
    }
    out << std::defaultfloat;
}

double shadowBytes(const Json& run) {
    double bytes = 0;
    for (const char* key : {"dag_bytes", "exact_bytes", "map_bytes"})
        bytes += run.value(key, 0.0);
    return bytes;
}

void printRuns(std::ostream& out, const Json& runs) {
    if (runs.empty())
        return;
    const auto labelOf = [](const Json& run) -> std::string {
        return (run.contains("shown_as") ? run["shown_as"] : run).at("label");
    };
    std::vector<std::string> names;
    for (const Json& run : runs)
        names.push_back("  " + labelOf(run));
    const int nameWidth = widthOf(names, 40);
    out << std::left << std::setw(nameWidth) << "run" << std::right << std::setw(10) << "ms"
        << std::setw(kIntervalWidth) << kIntervalHeading << std::setw(5) << "n" << std::setw(14)
        << "false shadow" << std::setw(13) << "false light" << std::setw(12) << "mean error"
        << std::setw(9) << "flip" << std::setw(10) << "MiB"
        << "\n"
        << std::fixed;
    std::string heading;
    for (const Json& run : runs) {
        const std::string group = run.at("scene").get<std::string>() + ", frame " +
                                  std::to_string(run.at("frame").get<uint32_t>());
        if (group != heading)
            out << (heading = group) << "\n";
        const double pairs = std::max(1.0, run.at("pair_count").get<double>());
        out << "  " << std::left << std::setw(nameWidth - 2) << labelOf(run) << std::right
            << std::setw(10) << std::setprecision(2) << run.at("time_ms").get<double>()
            << std::setw(kIntervalWidth) << intervalText(run, "time_ms") << std::setw(5)
            << run.value("repeat_count", 0) << std::setw(12) << std::setprecision(3)
            << 100 * run.at("false_shadow_count").get<double>() / pairs << " %" << std::setw(11)
            << 100 * run.at("false_light_count").get<double>() / pairs << " %" << std::setw(12)
            << std::setprecision(5) << run.at("mean_abs_visibility_error").get<double>()
            << std::setw(9) << std::setprecision(4) << run.at("flip").get<double>() << std::setw(10)
            << std::setprecision(2);
        out << shadowBytes(run) / (1024.0 * 1024.0) << "\n";
        if (const std::string note = poolNote(run); !note.empty())
            out << "    " << note << "\n";
    }
    const auto renamed = std::find_if(runs.begin(), runs.end(),
                                      [](const Json& run) { return run.contains("shown_as"); });
    if (renamed != runs.end())
        out << renamed->at("shown_as").at("why").get<std::string>() << "\n";
    out << std::defaultfloat;
}

} // namespace shadowdag
