// SPDX-License-Identifier: Apache-2.0
#include "tools/workspace/journal.h"

#include "cuda/error.h"
#include "scenes/content_hash.h"
#include "scenes/input_file.h"
#include "scenes/output_file.h"
#include "scenes/scene_kind.h"
#include "tools/settings/json_file.h"
#include "tools/settings/words.h"
#include "tools/workspace/image_io.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <optional>
#include <sstream>

namespace shadowdag {

namespace {

/// No file is hashed that is larger: the most that a glTF file may have.
constexpr uint64_t kMaxHashedBytes = 0xffffffffu;

std::optional<std::string> fileBytes(const std::string& path) {
    std::string why;
    return readInput(path, {kMaxHashedBytes}, why);
}

std::string hashOf(const std::optional<std::string>& bytes) {
    return bytes ? hashText(contentHash(bytes->data(), bytes->size())) : "missing";
}

std::string hashOfFile(const std::string& path) {
    return hashOf(fileBytes(path));
}

/// Returns the text of a URI with its %XX decoded.
std::string decoded(const std::string& uri) {
    std::string text;
    for (size_t i = 0; i < uri.size(); ++i) {
        const std::string digits = uri.substr(i + 1, 2);
        if (uri[i] == '%' && digits.size() == 2 &&
            digits.find_first_not_of("0123456789abcdefABCDEF") == std::string::npos) {
            text += char(std::stoi(digits, nullptr, 16));
            i += 2;
        } else {
            text += uri[i];
        }
    }
    return text;
}

/// Returns the files beside a .gltf or .glb that it refers to. Source: glTF 2.0, sec. 2.8 and 4.4.
std::vector<std::string> referredFiles(const std::string& path, const std::string& bytes) {
    std::string text = bytes;
    uint32_t length = 0;
    if (bytes.starts_with("glTF") && bytes.size() > 20) {
        std::memcpy(&length, bytes.data() + 12, sizeof length);
        text = bytes.substr(20, length);
    }
    const Json json = parseOwnJson(text, 256); // as readGltf
    std::vector<std::string> files;
    for (const char* list : {"buffers", "images"})
        if (json.is_object() && json.contains(list) && json[list].is_array())
            for (const Json& item : json[list])
                if (item.is_object() && item.contains("uri") && item["uri"].is_string())
                    if (const std::string uri = item["uri"]; !uri.starts_with("data:"))
                        files.push_back(
                            (std::filesystem::path(path).parent_path() / decoded(uri)).string());
    return files;
}

/// Returns the names that lines of a text state after one of the words that begin so: in an OBJ
/// file of its material libraries, in these of their images. After options, whose values are not
/// known here, the name may begin at each word: all that may be meant are returned.
std::vector<std::string> namesOfLines(const std::string& text, const std::string& word) {
    std::vector<std::string> found;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
        const size_t begin = line.find_first_not_of(" \t"), end = line.find_last_not_of(" \t\r");
        if (begin == std::string::npos || line.compare(begin, word.size(), word) != 0)
            continue;
        const size_t space = line.find_first_of(" \t", begin);
        size_t name = line.find_first_not_of(" \t", space);
        if (space > end || name > end)
            continue;
        std::replace(line.begin(), line.end(), '\\', '/');
        const bool hasOptions = line[name] == '-';
        do {
            found.push_back(line.substr(name, end + 1 - name));
            name = line.find_first_not_of(" \t", line.find_first_of(" \t", name));
        } while (hasOptions && name < end);
    }
    return found;
}

/// Returns the text of a journal's key or parts.
std::string textOf(const Json& json) {
    return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

/// Returns whether a value names a picture that is not whole in the folder or in its `images`.
bool namesAbsentPicture(const Json& value, const std::string& folder) {
    if (value.is_string()) {
        const std::string name = value;
        return name.ends_with(".png") && !isWholePng(folder + "/" + name) &&
               !isWholePng(folder + "/images/" + name);
    }
    return value.is_structured() && std::any_of(value.begin(), value.end(), [&](const Json& item) {
               return namesAbsentPicture(item, folder);
           });
}

} // namespace

Json inputHashes(const std::vector<std::string>& scenes, const std::vector<std::string>& files) {
    Json hashes = {{"program", hashOfFile("/proc/self/exe")}};
    for (const std::string& scene : scenes) {
        if (scene.starts_with("builtin:")) {
            hashes[scene] = "program"; // its text is part of it
            continue;
        }
        const std::optional<std::string> bytes = fileBytes(scene);
        hashes[scene] = hashOf(bytes);
        if (!bytes)
            continue;
        for (const std::string& file : referredFiles(scene, *bytes))
            hashes[file] = hashOfFile(file);
        if (lowerCaseExtension(scene) != ".obj")
            continue;
        const std::filesystem::path folder = std::filesystem::path(scene).parent_path();
        const auto bytesOf = [&](const std::string& name) {
            const std::string path = (folder / name).string();
            const std::optional<std::string> found = fileBytes(path);
            hashes[path] = hashOf(found);
            return found;
        };
        for (const std::string& library : namesOfLines(*bytes, "mtllib")) {
            std::optional<std::string> materials = bytesOf(library);
            if (!materials) // as its reader does
                materials = bytesOf(std::filesystem::path(scene).stem().string() + ".mtl");
            for (const std::string& image : namesOfLines(materials.value_or(""), "map_")) {
                bytesOf(image);
                bytesOf(image.substr(image.rfind('/') + 1)); // where it is not in that folder
            }
        }
    }
    for (const std::string& file : files)
        hashes[file] = hashOfFile(file);
    return hashes;
}

namespace {

/// Appends "KEY was A and is B" of every value in which two values differ.
void addDifferences(const std::string& key, const Json& before, const Json& now,
                    std::vector<std::string>& differences) {
    if (before.is_object() && now.is_object()) {
        const std::string prefix = key.empty() ? "" : key + ".";
        for (const auto& [name, value] : before.items())
            addDifferences(prefix + name, value, now.value(name, Json()), differences);
        for (const auto& [name, value] : now.items())
            if (!before.contains(name))
                addDifferences(prefix + name, Json(), value, differences);
        return;
    }
    const auto shown = [](const Json& value) {
        return value.is_null() ? std::string("nothing") : jsonLine(value);
    };
    if (before != now)
        differences.push_back((key.empty() ? "the key" : key) + " was " + shown(before) +
                              " and is " + shown(now));
}

} // namespace

std::string differenceText(const Json& before, const Json& now) {
    constexpr size_t kMost = 8;
    std::vector<std::string> differences;
    addDifferences("", before, now, differences);
    std::string text;
    for (size_t i = 0; i < std::min(kMost, differences.size()); ++i)
        text += (i == 0 ? "" : "; ") + differences[i];
    if (differences.size() > kMost)
        text += "; and " + std::to_string(differences.size() - kMost) + " more";
    return text;
}

std::string remarkOn(const Journal& journal) {
    const size_t reused = journal.takenUpCount(), lost = journal.lostCount();
    const auto parts = [](size_t count) { return countText(count, "finished part"); };
    std::string text;
    if (reused > 0)
        text = parts(reused) + (reused == 1 ? " is reused" : " are reused");
    if (lost > 0)
        text += (reused > 0 ? "; " + std::to_string(lost) : parts(lost)) +
                (lost == 1 ? " lost its pictures and is measured again"
                           : " lost their pictures and are measured again");
    return text;
}

Journal::Journal(std::string path, Json key, bool resume) : path_(std::move(path)) {
    content_ = {{"key", std::move(key)}, {"parts", Json::object()}};
    if (!resume || !std::filesystem::exists(path_)) {
        save();
        return;
    }
    Json found = readOwnJsonFile(path_);
    if (found.is_discarded() || !found.is_object() || !found.contains("key") ||
        !found.contains("parts") || !found["parts"].is_object())
        throw Error(ErrorKind::kInput,
                    path_ + ": is damaged, so that its parts are lost; delete it to measure again");
    if (const std::string difference = differenceText(found["key"], content_["key"]);
        !difference.empty())
        throw Error(ErrorKind::kUsage,
                    path_ + ": belongs to another run: " + difference +
                        "; repeat the command of that run to resume it, choose another directory, "
                        "or delete " +
                        std::filesystem::path(path_).parent_path().string() +
                        " with its finished parts");
    if (found.value("parts_hash", Json()) != hashOf(textOf(found["parts"])))
        throw Error(ErrorKind::kInput, path_ + ": its parts were damaged or edited; delete it to "
                                               "measure again");
    content_["parts"] = std::move(found["parts"]);
    const std::string folder = std::filesystem::path(path_).parent_path().string();
    for (auto part = content_["parts"].begin(); part != content_["parts"].end();) {
        const bool isLost = namesAbsentPicture(*part, folder);
        lostCount_ += isLost;
        part = isLost ? content_["parts"].erase(part) : std::next(part);
    }
    takenUpCount_ = content_["parts"].size();
    if (takenUpCount_ > 0)
        noteFinishedParts();
}

const Json* Journal::find(const std::string& part) const {
    const Json& parts = content_["parts"];
    const auto found = parts.find(part);
    return found == parts.end() ? nullptr : &*found;
}

void Journal::set(const std::string& part, Json value) {
    content_["parts"][part] = std::move(value);
    save();
}

void Journal::save() const {
    if (path_.empty())
        return;
    OutputFile file(path_);
    const std::string parts = textOf(content_["parts"]);
    file.write("{\"key\":" + textOf(content_["key"]) + ",\"parts\":" + parts +
               ",\"parts_hash\":\"" + hashOf(parts) + "\"}");
    file.commit();
    if (!content_["parts"].empty())
        noteFinishedParts();
}

} // namespace shadowdag
