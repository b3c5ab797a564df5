// SPDX-License-Identifier: Apache-2.0
// Reads the groups and bands of stability, and runs them.
#include "tools/studies/stability.h"

#include "cuda/error.h"
#include "scenes/builtin.h"
#include "scenes/fail_scenes.h"
#include "scenes/warning.h"
#include "tools/report/csv.h"
#include "tools/settings/parse.h"

#include <algorithm>
#include <bit>

namespace shadowdag {

namespace {

constexpr const char* const kUnits[] = {"voxel", "texel"};
constexpr const char* const kAxes[] = {"x", "y"};

/// Reads a formula that can be evaluated.
std::string readFormula(StudyReader& reader, const char* key) {
    const std::string formula = reader.required(key);
    try {
        limitsOf({"", {}, {}, {}, "", formula, "0", "", ""}, MatrixMethod::kMaps, {});
    } catch (const Error& error) {
        reader.refuse(key, formula, std::string("is not a formula: ") + error.what());
    }
    return formula;
}

StabilityGroup readGroup(StudyReader& reader) {
    StabilityGroup group;
    group.name = reader.required("name");
    group.part = StabilityPart(reader.choice("part", kStabilityPartNames));
    group.what = reader.required("what");
    if (group.part != StabilityPart::kNumeric)
        group.scene = reader.required("scene");
    reader.number("outlines", group.outlineCount, 0, 1e9);
    reader.text("kind", group.kind);
    reader.number("resolved_at", group.resolvedAt, 0, 1e30);
    group.settings = reader.settings("settings");
    reader.numbers("sizes", group.sizes, 1, 131072);
    if (group.part == StabilityPart::kNumeric && group.kind != "rays" && group.kind != "faces")
        reader.refuse("kind", group.kind, "must be rays or faces for the numeric part");
    for (const uint32_t size : group.sizes)
        if (group.kind == "rays" && (!std::has_single_bit(size) || size < 16))
            reader.refuse("sizes", size, "must contain powers of two from 16 on for rays");
    return group;
}

StabilityBand readBand(StudyReader& reader) {
    StabilityBand band;
    band.id = reader.required("id");
    band.part = StabilityPart(reader.choice("part", kStabilityPartNames));
    reader.texts("kinds", band.kinds);
    for (const size_t method : reader.choices("methods", kMatrixMethodNames))
        band.methods.push_back(MatrixMethod(method));
    band.measure = reader.required("measure");
    band.low = readFormula(reader, "low");
    band.high = readFormula(reader, "high");
    reader.text("formula", band.formula);
    band.reason = reader.required("reason");
    return band;
}

Perturbation readPerturbation(StudyReader& reader) {
    Perturbation p;
    p.name = reader.required("case");
    p.kind = reader.required("kind");
    reader.number("by", p.by, -1e6, 1e6);
    if (p.by != 0) {
        p.part = int(reader.choice("part", kPerturbedParts));
        p.isTexel = reader.choice("unit", kUnits) == 1;
    }
    reader.number("shift", p.shift, -1e9, 1e9);
    reader.number("scale", p.scale, 1e-6, 1e6);
    reader.number("degrees", p.degrees, -360, 360);
    if (p.degrees != 0)
        p.isAboutX = reader.choice("axis", kAxes) == 0;
    return p;
}

/// Leaves out what a row says of its own scene, for another one: how many outlines it has, what
/// voxels resolve it, that it is aligned with the axes. Rates then have no band.
void forgetScene(StabilityGroup& group) {
    group.isOnOtherScene = true;
    group.outlineCount = 0;
    group.resolvedAt = StabilityGroup().resolvedAt;
    if (group.part == StabilityPart::kResolution)
        group.kind = "mixed";
    if (group.part == StabilityPart::kPerturbation)
        group.kind.clear();
}

constexpr const char* kMovingLights = "moving lights"; ///< a kind

/// Returns whether the lights of a scene can be moved: those of failure scenes.
bool areLightsMovable(const std::string& sceneName) {
    const std::vector<FailScene> scenes = failScenes();
    return std::any_of(scenes.begin(), scenes.end(), [&](const FailScene& scene) {
        return "builtin:" + scene.name == sceneName;
    });
}

class StabilityStudy : public Study {
public:
    StabilityStudy(const StudyFile& file, const StudyRequest& request)
        : table_(readStability(file)) {
        table_.backend = request.backend;
        for (StabilityGroup& group : stabilityGroupsNamed(table_, request.names)) {
            if (request.scenes.empty() || group.scene.empty())
                groups_.push_back(group);
            else
                for (const std::string& scene : request.scenes) {
                    if (isLeftOut(group, scene, request))
                        continue;
                    StabilityGroup of = group;
                    of.name = rowNameOn(group.name, scene);
                    of.scene = scene;
                    forgetScene(of);
                    groups_.push_back(of);
                }
        }
        table_.groups = groups_;
        isWhole_ = request.names.empty() && request.scenes.empty();
        for (const StabilityGroup& group : groups_)
            if (group.kind == kMovingLights)
                stabilityScene(group); // throws where its lights cannot be moved
    }

    std::vector<std::string> parts() const override {
        std::vector<std::string> names;
        for (const StabilityGroup& group : groups_)
            names.push_back(group.name);
        return names;
    }
    std::vector<std::string> scenes() const override {
        std::vector<std::string> scenes;
        for (const StabilityGroup& group : groups_)
            if (!group.scene.empty())
                scenes.push_back(group.scene);
        return scenes;
    }
    Json measure(size_t part, const StudyRequest&) override {
        return measureStability(table_, groups_.at(part));
    }
    std::vector<std::string> brokenLines(const Json& results) const override {
        std::vector<std::string> lines = unstableLines(results);
        if (isWhole_)
            for (std::string& line : unmatchedLines(table_, results["checks"]))
                lines.push_back(std::move(line));
        return lines;
    }
    std::string judged(const Json& results) const override {
        return std::to_string(results["checks"].size()) + " checks";
    }
    std::string csv(const Json& results) const override { return flatCsv(results["checks"]); }
    bool drawsCharts() const override { return true; }
    Json counts(const Json& results) const override {
        return {{"check_count", results["checks"].size()}};
    }
    std::string needsBeyondGl() const override { return "rays against triangles"; }

private:
    /// Returns whether a row is not measured on a scene, with a warning: its lights would have to
    /// move, which --only did not ask for by the row's name.
    static bool isLeftOut(const StabilityGroup& group, const std::string& scene,
                          const StudyRequest& request) {
        if (group.kind != kMovingLights || areLightsMovable(scene) ||
            std::find(request.names.begin(), request.names.end(), group.name) !=
                request.names.end())
            return false;
        warn("study stability: the row " + group.name + " is left out on " + scene +
             ", whose lights cannot be moved; only those of failure scenes, builtin:fail-..., can");
        return true;
    }

    StabilityTable table_;
    std::vector<StabilityGroup> groups_;
    bool isWhole_ = false; ///< all rows are measured, on their own scenes
};

} // namespace

StabilityTable readStability(const StudyFile& file) {
    StabilityTable table;
    readStudy(file, [&](StudyReader& study) {
        study.number("width", table.settingsWidth, 2, 8192);
        table.width = table.settingsWidth;
        uint32_t finest = 1u << table.finestVoxelsLog2;
        study.number("finest_voxels", finest, 256, 4096);
        if (!std::has_single_bit(finest))
            study.refuse("finest_voxels", finest, "must be a power of two");
        table.finestVoxelsLog2 = uint32_t(std::countr_zero(finest));
        study.numbers("undersample", table.undersamples, 1.0 / 64, 1024);
        study.number("frames", table.frameCount, 2, 1000);
        study.number("step_s", table.stepSeconds, 0, 1e6);
        study.list("cases", "case", [&](StudyReader& reader) {
            table.cases.push_back({MatrixMethod(reader.choice("method", kMatrixMethodNames)),
                                   reader.required("name"), reader.settings("settings")});
        });
        study.list("perturbations", "perturbation", [&](StudyReader& reader) {
            table.perturbations.push_back(readPerturbation(reader));
        });
        study.rows([&](StudyReader& reader) { table.groups.push_back(readGroup(reader)); });
        study.requireRows(table.groups.size());
        study.list("bands", "band",
                   [&](StudyReader& reader) { table.bands.push_back(readBand(reader)); });
        study.list("known", "known", [&](StudyReader& reader) {
            KnownBreak known{reader.required("group"),
                             reader.required("kind"),
                             reader.required("method"),
                             reader.required("measure"),
                             0,
                             0,
                             reader.required("reason")};
            reader.number("low", known.low, -1e9, 1e9);
            reader.number("high", known.high, known.low, 1e9);
            table.known.push_back(known);
        });
    });
    return table;
}

std::vector<std::string> stabilitySettings(const StabilityTable& table,
                                           const StabilityGroup& group) {
    const double threshold = cellSetup({group.settings}).hybridTexels;
    return {"resolution=512", group.settings,
            "threshold=" + numberText(threshold * table.width / table.settingsWidth)};
}

Scene stabilityScene(const StabilityGroup& group) {
    if (group.kind != kMovingLights)
        return loadScene(group.scene);
    for (FailScene& scene : failScenes())
        if ("builtin:" + scene.name == group.scene) {
            scene.eyeSway = glm::dvec3(0.0);
            for (size_t i = 0; i < scene.lights.size(); ++i)
                scene.lights[i].velocity = {i % 2 ? 0.5 : -0.5, 0.0, i % 3 ? 0.375 : -0.375};
            return makeFailScene(scene);
        }
    throw Error(ErrorKind::kUsage,
                "group " + group.name + ": lights of the scene '" + group.scene +
                    "' cannot be moved; use a failure scene, builtin:fail-..., or name the "
                    "other rows by --only");
}

std::vector<StabilityGroup> stabilityGroupsNamed(const StabilityTable& table,
                                                 const std::vector<std::string>& names) {
    if (names.empty())
        return table.groups;
    std::vector<StabilityGroup> chosen;
    for (const std::string& name : names) {
        const size_t before = chosen.size();
        for (const StabilityGroup& group : table.groups)
            if ((group.name == name || kStabilityPartNames[size_t(group.part)] == name) &&
                std::none_of(chosen.begin(), chosen.end(),
                             [&](const StabilityGroup& of) { return of.name == group.name; }))
                chosen.push_back(group);
        if (chosen.size() == before) {
            std::string all = "time, perturbation, numeric, resolution";
            for (const StabilityGroup& group : table.groups)
                all += ", " + group.name;
            throw Error(ErrorKind::kUsage,
                        "--only '" + name + "': must be one of " + all + ", each at most once");
        }
    }
    return chosen;
}

Json measureStability(const StabilityTable& table, const StabilityGroup& group) {
    Json results = Json::object();
    for (const char* key : {"time", "perturbation", "numeric", "resolution", "rates", "checks"})
        results[key] = Json::array();
    constexpr void (*kMeasure[kStabilityPartCount])(const StabilityTable&, const StabilityGroup&,
                                                    Json&) = {measureTime, measurePerturbation,
                                                              measureNumeric, measureResolution};
    kMeasure[size_t(group.part)](table, group, results);
    return results;
}

std::vector<std::string> unstableLines(const Json& results) {
    std::vector<std::string> lines;
    for (const Json& check : results["checks"])
        if (!check["holds"].get<bool>())
            lines.push_back(check["group"].get<std::string>() + ", " +
                            check["case"].get<std::string>() + ", by " +
                            check["method"].get<std::string>() + ": " +
                            check["measure"].get<std::string>() + " is " + check["value"].dump() +
                            ", band " + check["low"].dump() + " to " + check["high"].dump() + " (" +
                            check["band"].get<std::string>() + ")");
    return lines;
}

std::unique_ptr<Study> makeStabilityStudy(const StudyFile& file, const StudyRequest& request,
                                          const Console&) {
    return std::make_unique<StabilityStudy>(file, request);
}

} // namespace shadowdag
