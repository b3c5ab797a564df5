// SPDX-License-Identifier: Apache-2.0
#include "tools/commands/compare_parts.h"

#include "cuda/error.h"
#include "scenes/content_hash.h"
#include "scenes/input_file.h"
#include "tools/report/csv.h"
#include "tools/report/results_table.h"
#include "tools/settings/json_file.h"
#include "tools/settings/provenance.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <sstream>

namespace shadowdag {

namespace {

/// Provenance of the machine, which may differ between parts.
constexpr const char* kMachineKeys[] = {
    "cpu",    kVectorInstructions, "processor_count", "memory_bytes", "system", "device",
    "driver", "thread_count"};

const char* const kLists[] = {"scenes", "runs", "map_costs", "truth_images", "warnings"};

void append(Json& to, const Json& from) {
    to.insert(to.end(), from.begin(), from.end());
}

/// Returns the hash of a file's content, "" when it cannot be read.
std::string fileHash(const std::string& path) {
    if (!whyNoInput(path, ~uint64_t(0)).empty())
        return "";
    std::ifstream file = openInput(path);
    if (!file)
        return "";
    ContentHasher hasher;
    std::vector<char> bytes(1 << 16);
    while (file.read(bytes.data(), std::streamsize(bytes.size())) || file.gcount() > 0)
        hasher.add(bytes.data(), size_t(file.gcount()));
    return file.bad() ? "" : hashText(hasher.hash());
}

/// Returns the files that a part refers to, relative to its directory.
std::set<std::string> filesOf(const Json& part) {
    std::set<std::string> files = {"costs.json"};
    for (const Json& run : part.at("runs"))
        if (run.contains("images"))
            for (const Json& file : run["images"])
                files.insert(file.get<std::string>());
    for (const Json& image : part.at("truth_images"))
        files.insert(image.at("file").get<std::string>());
    return files;
}

/// Throws unless the part is number K of N in the sense of `--part`.
void checkNumbers(const std::string& path, const Json& part) {
    const auto number = [&](const char* key, uint64_t max, const std::string& maxText) {
        const Json& value = part.contains(key) ? part[key] : Json();
        if (!value.is_number_unsigned() || value.get<uint64_t>() < 1 || value.get<uint64_t>() > max)
            throw Error(ErrorKind::kInput, path + ": \"" + key + "\" is " + value.dump() +
                                               "; it must be a whole number from 1 to " + maxText +
                                               ": run this part again");
        return value.get<uint64_t>();
    };
    const uint64_t count = number("part_count", kMaxRunPartCount, std::to_string(kMaxRunPartCount));
    number("part", count, "its part_count, " + std::to_string(count));
}

/// Throws unless the part and the files beside it are what `compare --part` wrote.
void checkContent(const std::string& path, const std::string& directory, const Json& part) {
    const std::string again = ": run this part again";
    if (part.value("content_hash", Json()) != partHash(part))
        throw Error(ErrorKind::kInput, path + ": is damaged or was edited" + again);
    for (const std::string& name : filesOf(part)) {
        const std::string file = directory + "/" + name, hash = fileHash(file);
        if (hash.empty())
            throw Error(ErrorKind::kInput,
                        file + ": cannot be read; " + path + " names it" + again);
        if (part.at("files").at(name) != hash)
            throw Error(ErrorKind::kInput, file + ": is not the file that its part wrote" + again);
    }
    // The data that the report needs are checked here, where the name of their file is known.
    runsCsv(part.at("runs"));
    flatCsv(part.at("lights"));
    for (const Json& warning : part.at("warnings"))
        static_cast<void>(warning.get<std::string>());
    std::ostringstream table;
    printRuns(table, part["runs"]);
    for (const Json& run : part["runs"]) {
        const Json images = run.value("images", Json::object());
        for (const Json& file : images)
            static_cast<void>(file.get<std::string>());
    }
}

Json readPart(const std::string& directory) {
    const std::string path = directory + "/part.json";
    if (const std::string why = whyNoInput(path, kMaxOwnJsonBytes); !why.empty())
        throw Error(ErrorKind::kInput,
                    path + ": " + why + "; '" + directory +
                        "' is not a finished part of a compare: run compare --part K/N -o " +
                        directory);
    Json part = readJsonFile(path, "run this part again", kMaxOwnJsonBytes);
    bool isWhole = part.is_object() && part.contains("key") && part["key"].is_object() &&
                   part.contains("provenance") && part["provenance"].is_object() &&
                   part.contains("experiment") && part.contains("lights") &&
                   part["lights"].is_array();
    for (const char* list : kLists)
        isWhole = isWhole && part.contains(list) && part[list].is_array();
    if (!isWhole)
        throw Error(ErrorKind::kInput, path + ": is damaged; run this part again");
    try {
        checkNumbers(path, part);
        checkContent(path, directory, part);
    } catch (const Json::exception& error) {
        throw Error(ErrorKind::kInput,
                    path + ": was not written by compare; run this part again: " + error.what());
    }
    return part;
}

/// Returns the first key in which two objects differ, "" when they are equal.
std::string differingKey(const Json& a, const Json& b) {
    for (const auto& [key, value] : a.items())
        if (!b.contains(key) || b[key] != value)
            return key;
    for (const auto& [key, value] : b.items())
        if (!a.contains(key))
            return key;
    return "";
}

/// Returns the numbers as text: "2, 5"; only the first if there are many.
std::string listText(const std::vector<uint32_t>& numbers) {
    constexpr size_t kMost = 20;
    std::string text;
    for (size_t i = 0; i < std::min(kMost, numbers.size()); ++i)
        text += (text.empty() ? "" : ", ") + std::to_string(numbers[i]);
    if (numbers.size() > kMost)
        text += " and " + std::to_string(numbers.size() - kMost) + " more";
    return text;
}

/// Throws unless the parts are those of one compare, each once. Returns them in order.
std::vector<Json> checkedParts(const std::vector<std::string>& directories) {
    std::map<uint32_t, std::pair<std::string, Json>> byNumber;
    for (const std::string& directory : directories) {
        Json part = readPart(directory);
        if (!byNumber.empty()) {
            const auto& [firstDirectory, first] = byNumber.begin()->second;
            std::string key = differingKey(first["key"], part["key"]);
            if (key.empty() && first["part_count"] != part["part_count"])
                key = "part_count";
            if (!key.empty()) {
                const auto text = [&](const Json& of) {
                    const Json& from = key == "part_count" ? of : of["key"];
                    return from.contains(key) ? from[key].dump() : std::string("nothing");
                };
                throw Error(ErrorKind::kInput, directory + ": belongs to another compare than " +
                                                   firstDirectory + ": its " + key + " is " +
                                                   text(part) + ", there " + text(first) +
                                                   "; run it again with the options of the others");
            }
        }
        const uint32_t number = part["part"].get<uint32_t>();
        const auto [found, isNew] = byNumber.try_emplace(number, directory, std::move(part));
        if (!isNew)
            throw Error(ErrorKind::kInput, directory + ": is part " + std::to_string(number) +
                                               ", as is " + found->second.first +
                                               "; name each part once");
    }
    const uint32_t count = byNumber.begin()->second.second["part_count"].get<uint32_t>();
    std::vector<uint32_t> missing;
    std::vector<Json> parts;
    for (uint32_t number = 1; number <= count; ++number) {
        const auto found = byNumber.find(number);
        if (found == byNumber.end())
            missing.push_back(number);
        else
            parts.push_back(std::move(found->second.second));
    }
    if (!missing.empty())
        throw Error(ErrorKind::kInput,
                    "of " + std::to_string(count) + " parts of the compare, missing: " +
                        listText(missing) + "; run compare --part " + std::to_string(missing[0]) +
                        "/" + std::to_string(count) + " and name its directory too");
    return parts;
}

} // namespace

std::vector<uint32_t> CompareShare::frames(const Experiment& experiment, size_t scene,
                                           uint32_t view) const {
    const size_t frameCount = experiment.frames.size(), viewCount = experiment.viewCount;
    const size_t all = frameCount * viewCount * experiment.scenes.size();
    std::vector<uint32_t> mine;
    for (size_t i = 0; i < frameCount; ++i)
        if (((scene * viewCount + view) * frameCount + i) * partCount / all == part - 1)
            mine.push_back(experiment.frames[i]);
    return mine;
}

bool CompareShare::has(const Experiment& experiment, size_t scene) const {
    for (uint32_t view = 0; view < experiment.viewCount; ++view)
        if (!frames(experiment, scene, view).empty())
            return true;
    return false;
}

CompareFindings::CompareFindings(const Json& provenance, const Json& experiment)
    : results({{"provenance", provenance}, {"experiment", experiment}}) {
    for (const char* list : kLists)
        results[list] = Json::array();
    results["sequence_runs"] = Json::array(); // not in parts: a sequence is not divided
}

void CompareFindings::add(SceneMeasurement&& measurement) {
    append(results["runs"], measurement.runs);
    append(results["sequence_runs"], measurement.sequenceRuns);
    append(results["map_costs"], measurement.mapCosts);
    append(results["truth_images"], measurement.truthImages);
    append(lights, measurement.lights);
    costs.merge(measurement.costs);
}

Json partKey(const Json& provenance, const Experiment& experiment, const Json& inputHashes) {
    Json key = provenance;
    for (const char* machine : kMachineKeys)
        key.erase(machine);
    key["scenes"] = experiment.scenes;
    key["inputs"] = inputHashes;
    return key;
}

Json toJson(const CompareFindings& findings, const CompareShare& share, const Json& key,
            const std::string& directory) {
    Json json = findings.results;
    json["part"] = share.part;
    json["part_count"] = share.partCount;
    json["key"] = key;
    json["lights"] = findings.lights;
    json["files"] = Json::object();
    for (const std::string& file : filesOf(json))
        if (Json& hash = json["files"][file] = fileHash(directory + "/" + file); hash == "")
            throw Error(ErrorKind::kResource, directory + "/" + file +
                                                  ": was written and cannot be read any more; run "
                                                  "the command again");
    json["content_hash"] = partHash(json);
    return json;
}

std::string partHash(Json part) {
    part.erase("content_hash");
    const std::string text = jsonText(part);
    return hashText(contentHash(text.data(), text.size()));
}

CompareFindings joinParts(const std::vector<std::string>& directories) {
    const std::vector<Json> parts = checkedParts(directories);
    CompareFindings all(parts[0]["provenance"], parts[0]["experiment"]);
    Json machines = Json::array();
    for (const Json& part : parts) {
        Json machine = {{"part", part["part"]}};
        for (const char* key : kMachineKeys)
            if (part["provenance"].contains(key))
                machine[key] = part["provenance"][key];
        machines.push_back(std::move(machine));
        for (const char* list : kLists)
            for (const Json& entry : part[list]) {
                Json& to = all.results[list];
                // A scene with frames in two parts is listed once, and what is said of it.
                const bool isOfScene = list == kLists[0] || std::string(list) == "warnings";
                if (!isOfScene || std::find(to.begin(), to.end(), entry) == to.end())
                    to.push_back(entry);
            }
        append(all.lights, part["lights"]);
    }
    for (const std::string& directory : directories)
        all.costs.merge(readCosts(directory + "/costs.json"));
    all.results["provenance"]["parts"] = std::move(machines);
    return all;
}

} // namespace shadowdag
