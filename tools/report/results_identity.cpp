// SPDX-License-Identifier: Apache-2.0
#include "tools/report/results_identity.h"

#include "cuda/error.h"
#include "tools/settings/experiment.h"
#include "tools/settings/json_file.h"
#include "tools/settings/parse.h"
#include "tools/settings/provenance.h"
#include "tools/workspace/journal.h"
#include "tools/workspace/study_kinds.h"

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <tuple>
#include <vector>

namespace shadowdag {

namespace {

constexpr const char* kMachineKeys[] = {"cpu",    kVectorInstructions, "device",
                                        "driver", "thread_count",      "backend"};
/// Keys of a study that do not change what is measured.
constexpr const char* kTextKeys[] = {"title",  "what",  "source",      "remedy",    "listed",
                                     "reason", "known", "unexplained", "untrusted", "slack"};

Json withoutTexts(const Json& value) {
    if (value.is_object()) {
        Json kept = Json::object();
        for (const auto& [key, inner] : value.items())
            if (std::find(std::begin(kTextKeys), std::end(kTextKeys), key) == std::end(kTextKeys))
                kept[key] = withoutTexts(inner);
        return kept;
    }
    if (value.is_array()) {
        Json kept = Json::array();
        for (const Json& inner : value)
            kept.push_back(withoutTexts(inner));
        return kept;
    }
    return value;
}

/// Returns whether a value has members, all of them objects with a key.
bool allHave(const Json& values, const char* key) {
    return (values.is_array() || values.is_object()) && !values.empty() &&
           std::all_of(values.begin(), values.end(),
                       [&](const Json& value) { return value.is_object() && value.contains(key); });
}

std::string kindOf(const Json& results) {
    if (!results.is_object())
        return "";
    if (results.contains("study") && results["study"].is_object() &&
        results["study"].contains("kind")) // a record of fuzzing has a target of this name
        return "study " + results["study"].value("kind", std::string());
    if (results.contains("runs") && results.contains("map_costs"))
        return "compare";
    if (results.contains("bench"))
        return "bench " + results.value("bench", std::string());
    if (results.contains("pair_count") && results.contains("occluded_count"))
        return "validate";
    if (results.contains("set_id") && results.contains("runs"))
        return "rays";
    if (results.contains("calibration") && results.contains("frames"))
        return "calibrate";
    for (const auto& [kind, first, second] :
         {std::tuple("gpu_check", "steps", "voxelize"), std::tuple("filters", "acne", "detached"),
          std::tuple("layouts", "traced", "files"), std::tuple("determinism", "rows", "left_out")})
        if (results.contains(first) && results[first].is_array() && results.contains(second))
            return kind;
    if (results.contains("scenes") && allHave(results["scenes"], "best_threshold"))
        return "regret";
    if (allHave(results, "tried_count"))
        return "faults";
    if (allHave(results, "executions"))
        return "fuzzing";
    for (const char* list : {"mechanisms", "cells", "checks"}) // studies before they were files
        if (results.contains(list))
            return std::string("study of ") + list;
    return "";
}

/// Adds the hashes of all scenes to an identity.
void addScenes(const Json& results, ResultsIdentity& identity) {
    identity.scenes = identity.contents = Json::object();
    const auto add = [&](const Json& of, const char* hash) {
        if (!of.is_object() || !of.contains("scene") || !of["scene"].is_string())
            return;
        const std::string scene = of["scene"];
        if (of.contains(hash))
            identity.scenes[scene] = of[hash];
        if (of.contains("content_hash"))
            identity.contents[scene] = of["content_hash"];
    };
    add(results, "scene_hash");
    add(results.value("about", Json()), "scene_hash"); // of a ray set
    for (const auto& [list, hash] :
         {std::pair("scenes", "scene_hash"), std::pair("cells", "geometry_hash")})
        if (results.contains(list) && results[list].is_array())
            for (const Json& scene : results[list])
                add(scene, hash);
}

/// Returns frames in one spelling: "7", "0:90", "0:90:30", "0,7,90".
std::string textOfFrames(const std::vector<uint32_t>& frames) {
    const std::string first = std::to_string(frames.front()), last = std::to_string(frames.back());
    if (frames.size() == 1)
        return first;
    const uint32_t step = frames[1] - frames[0];
    std::string list;
    bool isEven = true;
    for (size_t i = 0; i < frames.size(); ++i) {
        isEven &= i == 0 || frames[i] - frames[i - 1] == step;
        list += (i == 0 ? "" : ",") + std::to_string(frames[i]);
    }
    const std::string even = first + ":" + last + (step == 1 ? "" : ":" + std::to_string(step));
    return isEven ? even : list;
}

/// Gives an experiment of compare one spelling: rows are found by their names, whatever order
/// scenes and methods have.
void useOneSpelling(Json& experiment) {
    for (const char* list : {"scenes", "methods"})
        if (Json& values = experiment[list]; values.is_array())
            std::sort(values.begin(), values.end());
    if (Json& frames = experiment["frames"]; frames.is_string())
        try {
            frames = textOfFrames(parseFrames("frames", frames.get<std::string>()));
        } catch (const Error&) {
            // of an edited file: compared as it is
        }
}

} // namespace

void leaveOutRounds(ResultsIdentity& identity) {
    if (!identity.experiment.is_object())
        return;
    for (const char* key : {"repeats", "warmups"})
        identity.experiment.erase(key);
}

ResultsIdentity identityOf(const Json& results) {
    ResultsIdentity identity;
    identity.kind = kindOf(results);
    if (identity.kind.empty())
        return identity;
    identity.experiment = withoutTexts(
        results.contains("study") ? results["study"] : results.value("experiment", Json()));
    for (const char* key :
         {"method", "model", "parameters", "settings", "size", "resolution", "set_id"})
        if (results.contains(key)) // of validate, bench, rays and studies before they were files
            identity.experiment[std::string("of ") + key] = results[key];
    if (identity.kind == "compare" && identity.experiment.is_object()) {
        // A setting that is newer than the result had its default; --believe had another one.
        const Json defaults = toJson(Experiment());
        for (const auto& [key, value] : defaults.items())
            if (key != "believe" && !identity.experiment.contains(key))
                identity.experiment[key] = value;
        useOneSpelling(identity.experiment);
    }
    addScenes(results, identity);
    identity.machine = identity.program = Json::object();
    // A record of several machines has a list of them; its rows name what they were measured on.
    const bool isOne = results.contains("provenance") && results["provenance"].is_object();
    const Json provenance = isOne ? results["provenance"] : Json::object();
    for (const char* key : {"commit", "machine", "device"}) // of gpu_check
        if (identity.kind == "gpu_check" && results.contains(key))
            (std::string(key) == "commit" ? identity.program : identity.machine)[key] =
                results[key];
    for (const auto& [key, value] : provenance.items())
        if (std::find(std::begin(kMachineKeys), std::end(kMachineKeys), key) !=
            std::end(kMachineKeys))
            identity.machine[key] = value;
        else if (key != "experiment_hash")
            identity.program[key] = value;
    return identity;
}

std::string remarkOnReplaced(const std::string& directory, const Json& fresh) {
    const ResultsIdentity now = identityOf(fresh);
    std::vector<std::string> names = {"results", "part"};
    names.insert(names.end(), std::begin(kStudyKinds), std::end(kStudyKinds));
    for (const std::string& name : names) {
        ResultsIdentity before = identityOf(readOwnJsonFile(directory + "/" + name + ".json"));
        if (before.kind.empty())
            continue;
        for (const char* measured : {"of settings", "of size", "of resolution"})
            if (before.experiment.is_object() && !now.experiment.contains(measured))
                before.experiment.erase(measured); // of the new one it is not known yet
        const std::string difference = differenceText(before.experiment, now.experiment);
        if (before.kind == now.kind && difference.empty())
            continue;
        return "the report in " + directory +
               (before.kind == now.kind ? " is of another experiment (" + difference + ")"
                                        : " is of " + before.kind) +
               "; this run replaces it when it is finished, so choose another -o to keep it";
    }
    return "";
}

bool isFitResult(const Json& json) {
    return json.is_object() && json.contains("sweep") && json.contains("provenance");
}

void refuseToReplaceResults(const std::string& option, const std::string& path,
                            const std::string& allowed) {
    const Json json = readOwnJsonFile(path);
    const std::string kind = isFitResult(json) ? "fit" : identityOf(json).kind;
    if (!kind.empty() && kind != allowed)
        throw Error(ErrorKind::kUsage, option + " '" + path + "': would replace results of " +
                                           kind + "; choose another name");
}

std::string firstOtherScene(const ResultsIdentity& a, const ResultsIdentity& b) {
    for (const auto& [of, what] : {std::pair(&ResultsIdentity::scenes, "hash "),
                                   std::pair(&ResultsIdentity::contents, "content hash ")})
        for (const auto& [scene, hash] : (a.*of).items())
            if ((b.*of).contains(scene) && (b.*of)[scene] != hash)
                return scene + " has the " + what + hash.dump() + " and " + (b.*of)[scene].dump();
    return "";
}

} // namespace shadowdag
