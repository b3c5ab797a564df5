// SPDX-License-Identifier: Apache-2.0
#include "tools/workspace/frame_laps.h"

#include "cuda/statistics.h"
#include "tools/settings/camera_text.h"
#include "tools/workspace/frame_json.h"

#include <nlohmann/json.hpp>

#include <algorithm>

namespace shadowdag {

namespace {

Json rowOf(const SingleFrames& frames, uint32_t frame, float timeSeconds,
           const FrameResult& result) {
    Json row = {{"frame", frame},
                {"time_s", timeSeconds},
                {"camera_numbers", frames.reproduction()["camera_numbers"]},
                {"wall_ms", result.wallMs},
                {"time_ms", result.stages.totalMs()},
                {"stages_ms", toJson(result.stages)}};
    row.update(toJson(result.counts));
    row["pair_count"] = result.counts.pairCount;
    const HostCopyCounts& copies = result.counts.hostCopies;
    row["host_copy_count"] = copies.uploadCount + copies.readbackCount;
    row["host_readback_count"] = copies.readbackCount;
    return row;
}

} // namespace

Json timeLaps(SingleFrames& frames, const Experiment& experiment, int laps,
              const Progress& progress) {
    SDAG_ASSERT(laps >= 1);
    Json rows = Json::array();
    const size_t count = experiment.frames.size();
    for (size_t i = 0; i < count * size_t(laps); ++i) {
        progress(double(i) / double(count * size_t(laps)));
        const uint32_t frame = experiment.frames[i % count];
        const float time = experiment.timeOfFrame(frame);
        const FrameResult result = frames.renderNext(time, frame);
        if (i >= count * size_t(laps - 1))
            rows.push_back(rowOf(frames, frame, time, result));
    }
    progress(1.0);
    return rows;
}

Json summarizeLap(const Json& rows) {
    std::vector<double> wall, sums;
    std::vector<std::string> names;
    for (const Json& row : rows) {
        wall.push_back(row["wall_ms"].get<double>());
        sums.push_back(row["time_ms"].get<double>());
        for (const auto& [name, timeMs] : row["stages_ms"].items())
            if (std::find(names.begin(), names.end(), name) == names.end())
                names.push_back(name);
    }
    Json stages = Json::object();
    for (const std::string& name : names) {
        std::vector<double> times;
        for (const Json& row : rows)
            times.push_back(row["stages_ms"].value(name, 0.0));
        stages[name] = median(times);
    }
    return {{"wall_ms", median(wall)},
            {"wall_ms_max", *std::max_element(wall.begin(), wall.end())},
            {"time_ms", median(sums)},
            {"stages_ms", std::move(stages)}};
}

} // namespace shadowdag
