// SPDX-License-Identifier: Apache-2.0
#include "scenes/scene_folder.h"

#include "cuda/error.h"
#include "scenes/input_file.h"

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <utility>

namespace shadowdag {

namespace {

std::atomic<bool> isOutsideAllowed = false;

} // namespace

void allowOutsideFiles(bool isAllowed) {
    isOutsideAllowed = isAllowed;
}

std::vector<uint8_t> readSceneBytes(const std::string& path) {
    constexpr const char* kRemedy = "; name a scene's file, such as .glb or .gltf";
    std::error_code error;
    if (!std::filesystem::exists(path, error))
        throw Error(ErrorKind::kInput,
                    path + ": " + (error ? error.message() : "no such file") + "; check the name");
    if (!std::filesystem::is_regular_file(path, error))
        throw Error(ErrorKind::kInput, path + ": not a regular file" + kRemedy);
    std::string why;
    auto bytes = readInputBytes(path, {kMaxSceneFileBytes}, why);
    if (!bytes)
        throw Error(ErrorKind::kInput, path + ": " + why + kRemedy);
    if (bytes->empty())
        throw Error(ErrorKind::kInput, path + ": the file is empty");
    return std::move(*bytes);
}

SceneFolder::SceneFolder(const std::string& scenePath)
    : scenePath_(scenePath), path_(std::filesystem::path(scenePath).parent_path().string()) {
    if (path_.empty())
        path_ = ".";
}

std::string SceneFolder::join(const std::string& name) const {
    return path_ + (path_.back() == '/' ? "" : "/") + name;
}

std::string SceneFolder::nameOf(const std::string& joined) const {
    const std::string begin = join("");
    return joined.starts_with(begin) ? joined.substr(begin.size()) : joined;
}

std::string SceneFolder::filePathOf(const std::string& joined) const {
    const std::string name = nameOf(joined);
    return std::filesystem::path(name).is_absolute() ? name : joined;
}

std::string SceneFolder::refusalOf(const std::string& joined) const {
    if (joined.find('\0') != std::string::npos)
        return "its name contains a zero byte; rename the file";
    const std::string name = nameOf(joined);
    if (name.find("://") != std::string::npos)
        return "is an address, and nothing is fetched from the network; put the file beside the "
               "one that names it, and change its name there";
    if (isOutsideAllowed)
        return "";
    const std::filesystem::path relative(name), parent("..");
    const auto stepsUp = [&](const std::filesystem::path& path) {
        return std::find(path.begin(), path.end(), parent) != path.end();
    };
    std::error_code error;
    bool leadsOut = relative.is_absolute() || stepsUp(relative);
    if (!leadsOut && std::filesystem::exists(joined, error)) {
        const std::filesystem::path folder = std::filesystem::canonical(path_, error);
        std::filesystem::path file;
        if (!error)
            file = std::filesystem::canonical(joined, error);
        // From one to the other without a step up, or the links cannot be followed.
        leadsOut = error || stepsUp(file.lexically_relative(folder));
    }
    return leadsOut ? "is outside the file's folder; put it beside the file, or allow other places "
                      "with --allow-outside"
                    : "";
}

std::string SceneFolder::whyMissingBesideLink() const {
    std::error_code error;
    const std::filesystem::path target = std::filesystem::read_symlink(scenePath_, error);
    return error ? ""
                 : "no such file; '" + scenePath_ + "' is a link to '" + target.string() +
                       "', and files are read from the folder of the link: give the file itself";
}

std::string SceneFolder::whyNoFile(const std::string& filePath) const {
    std::error_code error;
    if (std::filesystem::exists(filePath, error))
        return whyNoInput(filePath, kMaxSceneFileBytes);
    if (error)
        return "cannot be opened: " + error.message();
    const std::string why = whyMissingBesideLink();
    return why.empty() ? "no such file; put it beside the file that names it" : why;
}

std::optional<std::vector<uint8_t>> SceneFolder::read(const std::string& joined,
                                                      std::string& why) const {
    why = refusalOf(joined);
    const std::string filePath = filePathOf(joined);
    if (why.empty())
        why = whyNoFile(filePath);
    return why.empty() ? readInputBytes(filePath, {kMaxSceneFileBytes, false, false}, why)
                       : std::nullopt;
}

} // namespace shadowdag
