// SPDX-License-Identifier: Apache-2.0
#include "scenes/assimp_parser.h"

#include "cuda/error.h"
#include "scenes/printable.h"
#include "scenes/scene_kind.h"

#include <assimp/IOSystem.hpp>
#include <assimp/Importer.hpp>
#include <assimp/MemoryIOWrapper.h>
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <assimp/version.h>

#include <algorithm>
#include <exception>
#include <filesystem>
#include <map>
#include <new>

namespace shadowdag::assimp {

namespace {

using Bytes = std::vector<uint8_t>;

/// The files that Assimp may open: the scene's, and those of its folder.
class FolderFiles : public Assimp::IOSystem {
public:
    /// @param name as Assimp knows the scene's file
    FolderFiles(const SceneFolder& folder, std::string name, const Bytes& bytes)
        : folder_(folder), name_(std::move(name)), bytes_(bytes) {}

    bool Exists(const char* file) const override {
        const std::string joined = joinedPathOf(file);
        return file == name_ || (folder_.refusalOf(joined).empty() &&
                                 folder_.whyNoFile(folder_.filePathOf(joined)).empty());
    }
    char getOsSeparator() const override { return '/'; }
    Assimp::IOStream* Open(const char* file, const char* mode) override {
        if (std::string(mode).find_first_of("wa+") != std::string::npos)
            return nullptr;
        if (file == name_)
            return new Assimp::MemoryIOStream(bytes_.data(), bytes_.size());
        const std::string joined = joinedPathOf(file);
        const auto known = read_.find(joined);
        std::string why;
        std::optional<Bytes> bytes;
        if (known == read_.end())
            bytes = folder_.read(joined, why);
        if (known == read_.end() && !bytes) {
            const bool isRefused = !folder_.refusalOf(joined).empty();
            (isRefused ? refusal_ : missing_).emplace(folder_.nameOf(joined), why);
            return nullptr;
        }
        const Bytes& content =
            known != read_.end() ? known->second : read_[joined] = std::move(*bytes);
        return new Assimp::MemoryIOStream(content.data(), content.size());
    }
    void Close(Assimp::IOStream* stream) override { delete stream; }
    bool CreateDirectory(const std::string&) override { return false; }
    bool ChangeDirectory(const std::string&) override { return false; }
    bool DeleteFile(const std::string&) override { return false; }

    /// The names of files that lie outside of the folder, and of those that cannot be read, each
    /// with the reason.
    const std::map<std::string, std::string>& refused() const { return refusal_; }
    const std::map<std::string, std::string>& missing() const { return missing_; }

private:
    /// Whatever Assimp made of a name, it is one of the folder. Separators of Windows are ours.
    std::string joinedPathOf(const char* file) const {
        std::string name = folder_.nameOf(file);
        std::replace(name.begin(), name.end(), '\\', '/');
        return folder_.join(name);
    }

    const SceneFolder& folder_;
    const std::string name_;
    const Bytes& bytes_;
    std::map<std::string, Bytes> read_;
    std::map<std::string, std::string> refusal_, missing_;
};

/// Returns the name of the scene's file for Assimp, which goes by extensions.
std::string nameFor(const SceneFolder& folder, const std::string& path,
                    const std::string& extension) {
    const std::string name = std::filesystem::path(path).filename().string();
    return folder.join(name + (lowerCaseExtension(path) == extension ? "" : extension));
}

std::string quotedNames(const std::map<std::string, std::string>& files) {
    constexpr size_t kMaxNames = 4;
    std::string text;
    size_t count = 0;
    for (const auto& [name, why] : files)
        if (count++ < kMaxNames)
            text += (text.empty() ? "'" : ", '") + utf8Of(name.substr(0, 80)) + "' (" + why + ")";
    return text + (count > kMaxNames ? ", ..." : "");
}

} // namespace

bool hasReader(const std::string& extension) {
    return !extension.empty() && Assimp::Importer().IsExtensionSupported(extension);
}

GltfSource parse(const std::string& path, const Bytes& bytes, const std::string& extension) {
    Conversion conversion(path);
    // Assimp 5.2 searches for the end of this header for ever.
    constexpr std::string_view kEnd = "end_header";
    if (extension == ".ply" &&
        std::search(bytes.begin(), bytes.end(), kEnd.begin(), kEnd.end()) == bytes.end())
        fail(conversion, "PLY header", "has no end_header; the file is cut short");
    conversion.isFbx = extension == ".fbx";
    conversion.hasFullAngles = conversion.isFbx || extension == ".3ds" || extension == ".prj" ||
                               extension == ".ase" || extension == ".ask";
    // Assimp's readers give the full angle, whatever its documentation says; that of FBX the half
    // one since 5.3.
    const bool isHalf = conversion.isFbx &&
                        std::pair(aiGetVersionMajor(), aiGetVersionMinor()) >= std::pair(5u, 3u);
    conversion.fovScale = isHalf ? 2.0f : 1.0f;

    const std::string name = nameFor(conversion.folder, path, extension);
    Assimp::Importer importer;
    auto* files = new FolderFiles(conversion.folder, name, bytes);
    importer.SetIOHandler(files); // which takes it over
    importer.SetPropertyBool(AI_CONFIG_IMPORT_NO_SKELETON_MESHES, true);
    const aiScene* const scene = importer.ReadFile(name, aiProcess_Triangulate);
    if (!files->refused().empty())
        throw Error(ErrorKind::kInput, printable(path + ": " + quotedNames(files->refused())));
    if (scene == nullptr) {
        if (const std::exception_ptr thrown = importer.GetException())
            try {
                std::rethrow_exception(thrown);
            } catch (const Error&) { // of FolderFiles
                throw;
            } catch (...) { // its text is the reason
            }
        const std::string reason = importer.GetErrorString();
        if (reason.find("bad_alloc") != std::string::npos)
            throw std::bad_alloc();
        throw Error(ErrorKind::kInput,
                    printableLine(path + ": Assimp cannot read it: " +
                                  reason.substr(0, std::min<size_t>(reason.find('\n'), 200))) +
                        "; it is damaged, or of a version that Assimp does not know; " +
                        kHowToConvert);
    }
    std::map<std::string, std::string> missing = files->missing();
    if (missing.size() > 1) // where a named one is missing, Assimp tries this name
        missing.erase(std::filesystem::path(path).stem().string() + ".mtl");
    if (!missing.empty())
        conversion.source.warnings.push_back(
            "Files that it names are missing: " + quotedNames(missing) + ".");
    const std::vector<UvSets> uvSets = writeMaterials(*scene, conversion);
    const std::string roots = writeNodes(*scene, uvSets, conversion);
    const glb::Parts& parts = conversion.parts;
    const std::string head = parts.head("", roots);
    if (head.size() + parts.binary.size() > glb::kMaxGlbBytes)
        fail(conversion, "its geometry", "is more than 4 GiB; split the scene");
    conversion.source.bytes.assign(head.begin(), head.end());
    conversion.source.bytes.insert(conversion.source.bytes.end(), parts.binary.begin(),
                                   parts.binary.end());
    return std::move(conversion.source);
}

void Conversion::warn(uint64_t count, const std::string& what) {
    if (count > 0)
        source.warnings.push_back(std::to_string(count) + " " + what);
}

void fail(const Conversion& conversion, const std::string& place, const std::string& problem) {
    throw Error(ErrorKind::kInput, printable(conversion.path + ": " + place + ": " + problem));
}

std::string textOf(const aiString& text) {
    const size_t length = std::min<size_t>(text.length, sizeof text.data - 1);
    return utf8Of(std::string_view(text.data, length));
}

std::string placeOf(const char* kind, size_t index, const aiString& name) {
    return kind + (" " + std::to_string(index)) +
           (name.length == 0 ? "" : " ('" + textOf(name).substr(0, 80) + "')");
}

} // namespace shadowdag::assimp
