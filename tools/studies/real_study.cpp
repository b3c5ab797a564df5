// SPDX-License-Identifier: Apache-2.0
// Reads the known real scenes, and computes the bounds of cells.
#include "tools/report/csv.h"
#include "tools/settings/console.h"
#include "tools/settings/parse.h"
#include "tools/studies/real_scenes.h"

#include "cuda/error.h"
#include "hybrid/judge/explain.h"
#include "scenes/scene_file.h"
#include "tools/workspace/scene_setup.h"

#include <algorithm>
#include <filesystem>
#include <map>

namespace shadowdag {

namespace {

/// Scenes are identified by their stems: of two equal ones, one would overwrite the other's
/// pictures.
void requireUniqueStems(const std::vector<std::string>& files) {
    std::map<std::string, std::string> firstOf;
    for (const std::string& file : files) {
        const auto [first, isNew] = firstOf.emplace(sceneStem(file), file);
        if (!isNew)
            throw Error(ErrorKind::kUsage,
                        first->second + " and " + file + " both have the name '" + first->first +
                            "' in the report; rename one or measure them separately");
    }
}

class RealStudy : public Study {
public:
    RealStudy(const StudyFile& file, const StudyRequest& request, const Console& console)
        : table_(readReal(file)), files_(realFiles(table_, request.scenes, console)),
          console_(console) {
        if (!request.names.empty())
            throw Error(ErrorKind::kUsage, "--only and a study of kind real contradict each other: "
                                           "the scenes given are measured; drop it");
    }

    std::vector<std::string> parts() const override { return files_; }
    std::vector<std::string> scenes() const override { return files_; }
    bool usesCache() const override { return true; }
    bool needsLights() const override { return table_.placedLightCount == 0; }
    Json measure(size_t part, const StudyRequest& request) override {
        return measureReal(table_, files_.at(part), request, console_);
    }
    std::vector<std::string> brokenLines(const Json& results) const override {
        return realBrokenLines(results);
    }
    std::string judged(const Json& results) const override {
        return "bounds of " + std::to_string(results["cells"].size()) +
               " cells, explaining has no power in " + std::to_string(powerlessCount(results));
    }
    void print(const Json& results, const Console& console) const override {
        for (const Json& cell : results["cells"])
            if (cell.contains("untrusted"))
                console.people() << cell["scene"].get<std::string>() << " by "
                                 << cell["method"].get<std::string>()
                                 << ": not to be trusted: " << cell["untrusted"].get<std::string>()
                                 << "\n";
        for (const Json& cell : results["cells"])
            if (cell["explaining_has_power"] == false)
                console.people() << cell["scene"].get<std::string>() << " by "
                                 << cell["method"].get<std::string>()
                                 << ": explaining has no power: "
                                 << numberText(100.0 * cell["outline_null_rate"].get<double>())
                                 << " % of the right results near outlines would be explained as "
                                    "well\n";
    }
    std::string csv(const Json& results) const override { return runsCsv(results["cells"]); }
    Json counts(const Json& results) const override {
        return {{"cell_count", results["cells"].size()},
                {"powerless_cell_count", powerlessCount(results)}};
    }
    std::string needsBeyondGl() const override { return "rays against triangles"; }

private:
    static size_t powerlessCount(const Json& results) {
        return size_t(
            std::count_if(results["cells"].begin(), results["cells"].end(),
                          [](const Json& cell) { return cell["explaining_has_power"] == false; }));
    }

    RealTable table_;
    std::vector<std::string> files_;
    const Console& console_;
};

} // namespace

const RealScene* RealTable::find(const std::string& name) const {
    const auto found = std::find_if(scenes.begin(), scenes.end(),
                                    [&](const RealScene& scene) { return scene.name == name; });
    return found == scenes.end() ? nullptr : &*found;
}

RealTable readReal(const StudyFile& file) {
    RealTable table;
    readStudy(file, [&](StudyReader& study) {
        table.settings = study.settings("settings");
        study.number("frames", table.frameCount, 1, 1000);
        study.number("placed_lights", table.placedLightCount, 0, kMaxPlacedLightCount);
        table.slack = readSlack(study);
        study.rows([&](StudyReader& reader) {
            RealScene scene;
            scene.name = reader.required("name");
            scene.geometryHash = reader.required("geometry_hash");
            scene.camera = "auto";
            reader.text("camera", scene.camera);
            scene.what = reader.required("what");
            reader.list("unexplained", "unexplained", [&](StudyReader& errors) {
                NamedErrors named;
                named.method = MatrixMethod(errors.choice("method", kMatrixMethodNames));
                errors.number("count", named.count, 1, 1e15);
                named.failure = errors.required("failure");
                named.reason = errors.required("reason");
                scene.named.push_back(named);
            });
            scene.known = readKnown(reader, false);
            reader.list("untrusted", "untrusted", [&](StudyReader& cells) {
                const size_t method = cells.choice("method", kMatrixMethodNames);
                scene.untrusted.push_back({MatrixMethod(method), cells.required("reason")});
            });
            table.scenes.push_back(scene);
        });
        study.list("tolerances", "tolerances", [&](StudyReader& reader) {
            RealTolerance tolerance;
            for (const size_t method : reader.choices("methods", kMatrixMethodNames))
                tolerance.methods.push_back(MatrixMethod(method));
            reader.number("false_shadow_share", tolerance.falseShadowShare, 0, 1);
            reader.number("false_light_share", tolerance.falseLightShare, 0, 1);
            reader.number("magnified_share", tolerance.magnifiedShare, 0, 1);
            reader.number("acne_share", tolerance.acneShare, 0, 1);
            reader.number("null_rate", tolerance.nullRate, 0, 1);
            reader.number("powerless_wrong_share", tolerance.powerlessWrongShare, 0, 1);
            table.tolerances.push_back(tolerance);
        });
    });
    return table;
}

std::vector<std::string> realFiles(const RealTable& table,
                                   const std::vector<std::string>& arguments,
                                   const Console& console) {
    namespace fs = std::filesystem;
    std::vector<std::string> files;
    for (const std::string& argument : arguments) {
        if (!fs::is_directory(argument)) {
            files.push_back(argument);
            continue;
        }
        std::vector<std::string> inside;
        for (const fs::directory_entry& entry : fs::directory_iterator(argument)) {
            const std::string extension = entry.path().extension().string();
            if (extension == ".glb" || extension == ".gltf")
                inside.push_back(entry.path().string());
        }
        std::sort(inside.begin(), inside.end());
        const size_t fileCount = inside.size();
        if (table.placedLightCount == 0)
            std::erase_if(inside, [](const std::string& file) {
                checkInterrupted();
                return readSceneFile(file).lights.empty();
            });
        if (inside.empty())
            throw Error(ErrorKind::kUsage,
                        argument +
                            (fileCount == 0 ? ": has no .glb or .gltf file; give another "
                                            : ": no .glb or .gltf file in it has lights; "
                                              "place some with the study's key "
                                              "\"placed_lights\", or give another ") +
                            "directory, or scenes");
        if (inside.size() < fileCount)
            console.note(argument + ": " + std::to_string(inside.size()) + " of " +
                         std::to_string(fileCount) + " scenes have lights");
        files.insert(files.end(), inside.begin(), inside.end());
    }
    if (files.empty())
        throw Error(ErrorKind::kUsage,
                    "study real needs scenes: give .glb or .gltf files, or a directory of them");
    sceneNames(files); // throws if one is given twice
    requireUniqueStems(files);
    return files;
}

Json explainingHasPower(const RealTable& table, MatrixMethod method, const Json& cell) {
    if (cell["outline_null_sample_count"] == 0)
        return nullptr;
    for (const RealTolerance& tolerance : table.tolerances)
        if (std::count(tolerance.methods.begin(), tolerance.methods.end(), method) != 0)
            return cell["outline_null_rate"].get<double>() <= tolerance.nullRate;
    return true;
}

Json realBounds(const RealTable& table, const RealScene* scene, MatrixMethod method,
                const Json& hasPower) {
    Json bounds = Json::object();
    CellCounts named{}, unnamed{};
    for (const NamedErrors& errors : scene ? scene->named : std::vector<NamedErrors>())
        if (errors.method == method)
            (isTestedFailure(errors.failure) ? named : unnamed)[0] += errors.count;
    bounds["unnamed_count"] = unnamed[0] == 0 ? 0 : boundOf(unnamed, table.slack)[0];
    if (scene) // anywhere else every error may be of a kind that a test names
        bounds["named_count"] = named[0] == 0 ? 0 : boundOf(named, table.slack)[0];
    const KnownCell* known = scene ? findKnown(scene->known, method, true) : nullptr;
    if (known) {
        const CellCounts bound = boundOf(known->counts, table.slack);
        for (size_t m = 0; m < bound.size(); ++m)
            bounds[kCellMeasureNames[m]] = bound[m];
    }
    const Untrusted* untrusted = nullptr;
    if (scene)
        for (const Untrusted& cell : scene->untrusted)
            if (cell.method == method)
                untrusted = &cell;
    for (const RealTolerance& tolerance : table.tolerances) {
        if (std::count(tolerance.methods.begin(), tolerance.methods.end(), method) == 0)
            continue;
        // Whether it is trusted or not.
        bounds["acne_share"] = tolerance.acneShare;
        if (untrusted)
            continue;
        bounds["false_shadow_share"] = tolerance.falseShadowShare;
        bounds["false_light_share"] = tolerance.falseLightShare;
        bounds["magnified_share"] = tolerance.magnifiedShare;
        if (hasPower == false)
            bounds["wrong_share"] = tolerance.powerlessWrongShare;
    }
    if (method == MatrixMethod::kDagNone) {
        // They are the truth, triangle by triangle, in double where Embree rounds: a pair whose
        // ray grazes an edge may differ, and counts as explained. Its recorded counts have no
        // slack.
        for (const char* name :
             {"false_shadow_count", "false_light_count", "mean_error_millionths", "flicker_count"})
            bounds[name] = 0;
        bounds["unexplained_count"] = 0;
        if (known)
            for (size_t m = 0; m < known->counts.size(); ++m)
                bounds[kCellMeasureNames[m]] = known->counts[m];
    }
    if (method == MatrixMethod::kDagNone)
        bounds["acne_count"] = 0;
    return bounds;
}

bool showsShadowEdge(const Json& cell) {
    const uint64_t dark = cell["occluded_count"].get<uint64_t>();
    return dark > 0 && dark < cell["pair_count"].get<uint64_t>();
}

Json realBroken(const Json& cell, const Json& bounds) {
    Json broken = Json::array();
    for (const auto& [name, bound] : bounds.items())
        if (cell[name].get<double>() > bound.get<double>())
            broken.push_back(name);
    if (cell.value("known", "") == "yes" && !showsShadowEdge(cell))
        broken.push_back("occluded_count");
    if (cell.value("pair_count", 1) == 0)
        broken.push_back("pair_count");
    return broken;
}

namespace {

/// Returns a measure for messages: counts as they are, shares in percent.
std::string measureText(const Json& value) {
    return value.is_number_float() ? numberText(100.0 * value.get<double>()) + " %" : value.dump();
}

} // namespace

std::vector<std::string> realBrokenLines(const Json& results) {
    std::vector<std::string> lines;
    for (const Json& cell : results["cells"])
        for (const Json& measure : cell["broken"]) {
            const std::string name = measure.get<std::string>();
            std::string line = cell["scene"].get<std::string>() + " by " +
                               cell["method"].get<std::string>() + ": ";
            if (name == "unknown")
                line += "it has no recorded counts; run tools/studies/update_known.py";
            else if (name == "pair_count")
                line += "no visible point faces a light within its range, so nothing was compared; "
                        "give the scene a view that sees lit surfaces";
            else if (name == "occluded_count")
                line += "shows no shadow edge, occluded_count is " + cell[name].dump() + " of " +
                        cell["pair_count"].dump() +
                        " pairs; give the scene a view that sees light "
                        "and shadow";
            else
                line += name + " is " + measureText(cell[name]) + ", bound " +
                        measureText(cell["bounds"][name]);
            if (name == "wrong_share")
                line += " where explaining has no power, so that it excuses no error";
            if (name == "unnamed_count" && !cell["unnamed"].empty()) {
                const Json& first = cell["unnamed"][0];
                line += "; the first: a " + first["error"].get<std::string>() + " in frame " +
                        first["frame"].dump() + " at pixel " + first["pixel"][0].dump() + "," +
                        first["pixel"][1].dump() + " of light " + first["light"].dump();
            }
            lines.push_back(line);
        }
    return lines;
}

std::unique_ptr<Study> makeRealStudy(const StudyFile& file, const StudyRequest& request,
                                     const Console& console) {
    return std::make_unique<RealStudy>(file, request, console);
}

} // namespace shadowdag
