// SPDX-License-Identifier: Apache-2.0
#include "tools/report/results_table.h"

#include "tools/workspace/frame_json.h"

#include <algorithm>
#include <iomanip>
#include <string>
#include <utility>
#include <vector>

namespace shadowdag {

void printSequences(std::ostream& out, const Json& rows) {
    if (rows.empty())
        return;
    struct Sum {
        double frameCount = 0, timeMs = 0, worstMs = 0, triangles = 0, texels = 0, pairs = 0,
               wrong = 0, answers = 0, flickers = 0;
    };
    std::vector<std::pair<std::string, Sum>> sums;
    for (const Json& row : rows) {
        const std::string name =
            row["scene"].get<std::string>() + ", " + row["label"].get<std::string>();
        auto found = std::find_if(sums.begin(), sums.end(),
                                  [&](const auto& sum) { return sum.first == name; });
        if (found == sums.end())
            found = sums.insert(sums.end(), {name, {}});
        Sum& sum = found->second;
        const auto value = [&](const char* key) { return row[key].get<double>(); };
        sum.frameCount += 1;
        sum.timeMs += value("time_ms");
        sum.worstMs = std::max(sum.worstMs, value("time_ms"));
        sum.triangles = std::max(sum.triangles, value("triangle_draw_count"));
        sum.texels = std::max(sum.texels, value("texel_count"));
        sum.pairs += value("pair_count");
        sum.wrong += value("false_shadow_count") + value("false_light_count");
        sum.answers += value("flicker_answer_count");
        sum.flickers += value("flicker_count");
    }
    out << std::left << std::setw(44) << "sequence" << std::right << std::setw(10) << "mean ms"
        << std::setw(10) << "worst ms" << std::setw(16) << "peak triangles" << std::setw(14)
        << "peak texels" << std::setw(9) << "wrong" << std::setw(11) << "flicker"
        << "\n"
        << std::fixed;
    for (const auto& [name, sum] : sums)
        out << std::left << std::setw(44) << name << std::right << std::setprecision(2)
            << std::setw(10) << sum.timeMs / sum.frameCount << std::setw(10) << sum.worstMs
            << std::setprecision(0) << std::setw(16) << sum.triangles << std::setw(14) << sum.texels
            << std::setprecision(2) << std::setw(7) << 100 * sum.wrong / std::max(1.0, sum.pairs)
            << " %" << std::setprecision(4) << std::setw(9)
            << 100 * sum.flickers / std::max(1.0, sum.answers) << " %\n";
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
    out << std::left << std::setw(40) << "run" << std::right << std::setw(10) << "ms"
        << std::setw(14) << "false shadow" << std::setw(13) << "false light" << std::setw(12)
        << "mean error" << std::setw(9) << "flip" << std::setw(10) << "MiB"
        << "\n"
        << std::fixed;
    std::string heading;
    for (const Json& run : runs) {
        const std::string group = run["scene"].get<std::string>() + ", frame " +
                                  std::to_string(run["frame"].get<uint32_t>());
        if (group != heading)
            out << (heading = group) << "\n";
        const double pairs = std::max(1.0, run["pair_count"].get<double>());
        out << "  " << std::left << std::setw(38) << run["label"].get<std::string>() << std::right
            << std::setw(10) << std::setprecision(2) << run["time_ms"].get<double>()
            << std::setw(12) << std::setprecision(3)
            << 100 * run["false_shadow_count"].get<double>() / pairs << " %" << std::setw(11)
            << 100 * run["false_light_count"].get<double>() / pairs << " %" << std::setw(12)
            << std::setprecision(5) << run["mean_abs_visibility_error"].get<double>()
            << std::setw(9) << std::setprecision(4) << run["flip"].get<double>() << std::setw(10)
            << std::setprecision(2);
        out << shadowBytes(run) / (1024.0 * 1024.0) << "\n";
        if (const std::string note = poolNote(run); !note.empty())
            out << "    " << note << "\n";
    }
    out << std::defaultfloat;
}

} // namespace shadowdag
