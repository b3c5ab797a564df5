// SPDX-License-Identifier: Apache-2.0
// Reads the rows of studies of scale, and reports where methods become faster than Embree.
#include "tools/report/csv.h"
#include "tools/settings/console.h"
#include "tools/settings/experiment.h"
#include "tools/settings/parse.h"
#include "tools/studies/scale.h"

#include "cuda/error.h"
#include "cuda/process_memory.h"

#include <algorithm>
#include <bit>
#include <cstdio>
#include <ostream>
#include <tuple>

namespace shadowdag {

namespace {

/// A row at one of its numbers of triangles.
struct ScalePart {
    ScaleRow row;
    size_t index;
};

class ScaleStudy : public Study {
public:
    ScaleStudy(const StudyFile& file, const StudyRequest& request, const Console& console)
        : table_(readScale(file)), console_(console) {
        if (request.backend != Backend::kCpu)
            throw Error(ErrorKind::kUsage,
                        "study scale: Embree and exact rays in packets run on the CPU; use "
                        "--backend cpu");
        for (const ScaleRow& row : chosenRows(request.names))
            if (request.scenes.empty()) {
                addParts(row);
            } else {
                for (const std::string& scene : request.scenes) {
                    ScaleRow given = row;
                    given.scene = scene;
                    given.name = rowNameOn(row.name, scene);
                    given.camera = ""; // of the row's own scene
                    addParts(given);
                }
            }
    }

    std::vector<std::string> parts() const override {
        std::vector<std::string> names;
        for (const ScalePart& part : parts_)
            names.push_back(part.row.name + " at " +
                            std::to_string(part.row.triangleCounts[part.index]));
        return names;
    }
    std::vector<std::string> scenes() const override {
        std::vector<std::string> scenes;
        for (const ScalePart& part : parts_)
            if (part.index == 0)
                scenes.push_back(part.row.scene);
        return scenes;
    }
    bool takesTimes() const override { return true; }
    bool drawsCharts() const override { return true; }
    bool needsLights() const override { return table_.placedLightCount == 0; }
    Json measure(size_t part, const StudyRequest& request) override {
        const ScalePart& of = parts_.at(part);
        return measureScale(table_, of.row, of.index, request, console_);
    }
    Json join(std::vector<Json> parts) const override {
        Json results = Study::join(std::move(parts));
        results["crossovers"] = crossoversOf(results["cells"]);
        return results;
    }
    /// Rays that believe no voxel answer as the truth does, however many triangles there are; but
    /// for the few pairs that rounding decides (docs/adjudicator.md).
    std::vector<std::string> brokenLines(const Json& results) const override {
        std::vector<std::string> lines;
        for (const Json& cell : results["cells"]) {
            const uint64_t wrong = cell["false_shadow_count"].get<uint64_t>() +
                                   cell["false_light_count"].get<uint64_t>();
            if (cell["method"] == "exact rays" &&
                double(wrong) > table_.mostExactWrongShare * cell["pair_count"].get<double>())
                lines.push_back(
                    cell["row"].get<std::string>() + " at " + cell["triangle_count"].dump() +
                    " triangles by exact rays: " + std::to_string(wrong) + " of " +
                    cell["pair_count"].dump() + " pairs are wrong, more than the study allows");
        }
        return lines;
    }
    std::string judged(const Json& results) const override {
        return std::to_string(results["cells"].size()) + " cells, " +
               std::to_string(results["crossovers"].size()) + " comparisons with Embree";
    }
    void print(const Json& results, const Console& console) const override {
        for (const Json& of : results["crossovers"]) {
            char times[64] = "";
            if (of.contains("ns_per_pair"))
                std::snprintf(times, sizeof times, " (there %.3g and %.3g ns a pair%s)",
                              of["ns_per_pair"].get<double>(),
                              of["embree_ns_per_pair"].get<double>(),
                              of["are_apart"].get<bool>() ? "" : ", not apart");
            console.people() << of["row"].get<std::string>() << " by "
                             << of["method"].get<std::string>() << ": "
                             << of["text"].get<std::string>() << times << "\n";
        }
        for (const Json& of : results["skipped"])
            console.people() << of["row"].get<std::string>() << " at "
                             << of["asked_triangle_count"].dump()
                             << " triangles is skipped: " << of["reason"].get<std::string>()
                             << "\n";
    }
    std::string csv(const Json& results) const override {
        return flatCsv(results["cells"], {"round_times_ms"});
    }
    Json counts(const Json& results) const override {
        return {{"cell_count", results["cells"].size()},
                {"skipped_count", results["skipped"].size()},
                {"crossovers", results["crossovers"]}};
    }
    std::string needsBeyondGl() const override { return "rays against triangles"; }

private:
    /// Returns the named rows, or all that need not be named.
    std::vector<ScaleRow> chosenRows(const std::vector<std::string>& names) const {
        std::vector<std::string> all;
        for (const ScaleRow& row : table_.rows)
            all.push_back(row.name);
        std::vector<ScaleRow> rows;
        for (const size_t index : chooseRows(all, names))
            if (!names.empty() || !table_.rows[index].isOnlyByName)
                rows.push_back(table_.rows[index]);
        return rows;
    }
    void addParts(const ScaleRow& row) {
        for (const uint64_t count : row.triangleCounts) // before hours are spent on smaller ones
            requireScaleMemory(row.name, count, row.resolutionLog2.size(), processMemoryBytes());
        for (size_t index = 0; index < row.triangleCounts.size(); ++index)
            parts_.push_back({row, index});
    }

    ScaleTable table_;
    std::vector<ScalePart> parts_;
    const Console& console_;
};

ScaleRow readRow(StudyReader& reader) {
    ScaleRow row;
    row.name = reader.required("name");
    row.scene = reader.required("scene");
    row.what = reader.required("what");
    reader.text("camera", row.camera);
    row.growth = Growth(reader.choice("grow", kGrowthNames));
    reader.numbers("triangles", row.triangleCounts, 1, 200e6);
    if (row.triangleCounts.empty())
        reader.refuse("triangles", Json(), "must contain at least one value");
    std::vector<uint32_t> resolutions;
    reader.numbers("resolutions", resolutions, 16, 16384);
    if (resolutions.empty())
        reader.refuse("resolutions", Json(), "must contain at least one value");
    for (const uint32_t resolution : resolutions) {
        if (!std::has_single_bit(resolution))
            reader.refuse("resolutions", resolution, "must contain powers of two");
        row.resolutionLog2.push_back(uint32_t(std::countr_zero(resolution)));
    }
    std::sort(row.triangleCounts.begin(), row.triangleCounts.end());
    std::sort(row.resolutionLog2.begin(), row.resolutionLog2.end());
    for (const char* key : {"seed", "cover", "masked"})
        if (const Json* found = reader.find(key); found && row.growth != Growth::kLeaves)
            reader.refuse(key, *found, "is for rows that grow by leaves");
    reader.number("seed", row.leaves.seed, 0, 1e15);
    reader.number("cover", row.leaves.cover, 1e-6, 100);
    reader.flag("masked", row.leaves.isMasked);
    reader.flag("only_by_name", row.isOnlyByName);
    return row;
}

} // namespace

ScaleTable readScale(const StudyFile& file) {
    ScaleTable table;
    readStudy(file, [&](StudyReader& study) {
        table.settings = study.settings("settings");
        std::string size = "640x360";
        study.text("size", size);
        try {
            std::tie(table.width, table.height) = parseSize("size", size);
        } catch (const Error& error) {
            throw Error(ErrorKind::kInput, file.path + ": " + error.what());
        }
        study.number("warmups", table.warmups, 0, 100);
        study.number("repeats", table.repeats, 1, 1000);
        study.number("exact_wrong_share", table.mostExactWrongShare, 0, 1);
        study.number("placed_lights", table.placedLightCount, 0, kMaxPlacedLightCount);
        study.rows([&](StudyReader& reader) { table.rows.push_back(readRow(reader)); });
        study.requireRows(table.rows.size());
    });
    return table;
}

uint64_t scaleBytes(uint64_t triangleCount, size_t resolutionCount) {
    // Measured with the atrium from 0.3 to 12 million triangles (resident_bytes): 327 bytes more a
    // triangle with one resolution, 357 with three, rounded down. They are the scene and its world,
    // Embree's hierarchy twice (of the truth and of the method), ours, and the batches of each
    // resolution's renderer. Since then batches have vertices of their own (BatchVerticesView): 6
    // bytes, and 16 for each of 0.6 vertices a triangle.
    constexpr uint64_t kBytesPerTriangle = 300, kBytesOfResolution = 30;
    return triangleCount * (kBytesPerTriangle + kBytesOfResolution * resolutionCount);
}

void requireScaleMemory(const std::string& row, uint64_t triangleCount, size_t resolutionCount,
                        uint64_t availableBytes) {
    const uint64_t needed = scaleBytes(triangleCount, resolutionCount);
    if (needed > availableBytes)
        throw Error(ErrorKind::kResource,
                    "study scale: row \"" + row + "\" at " + std::to_string(triangleCount) +
                        " triangles takes at least " + std::to_string(needed >> 30) +
                        " GiB of memory, this process may take " +
                        std::to_string(availableBytes >> 30) +
                        " GiB; leave the number out of \"triangles\", or choose other rows with "
                        "--only");
}

std::unique_ptr<Study> makeScaleStudy(const StudyFile& file, const StudyRequest& request,
                                      const Console& console) {
    return std::make_unique<ScaleStudy>(file, request, console);
}

} // namespace shadowdag
