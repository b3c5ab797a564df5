// SPDX-License-Identifier: Apache-2.0
#include "scenes/gltf_reader.h"
#include "scenes/gltf_reader_screen.h"

#include "cuda/error.h"
#include "scenes/data_uri.h"
#include "scenes/input_file.h"
#include "scenes/json_text.h"
#include "scenes/printable.h"
#include "scenes/scene_folder.h"
#include "scenes/scene_kind.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <stdexcept>
#include <string_view>
#include <tuple>

namespace shadowdag::gltf {

namespace {

// A file may refer to a buffer file more than once, but not multiply its size.
constexpr int kMaxReadsOfOneFile = 4;

// Extensions that a file may require because they change neither geometry nor lights: colours come
// from base colours and emission factors alone here, so these are ignored with a warning.
constexpr std::array kColorExtensions = {
    "EXT_texture_webp",           "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",    "KHR_materials_diffuse_transmission",
    "KHR_materials_dispersion",   "KHR_materials_ior",
    "KHR_materials_iridescence",  "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_sheen",        "KHR_materials_specular",
    "KHR_materials_transmission", "KHR_materials_unlit",
    "KHR_materials_variants",     "KHR_materials_volume",
    "KHR_techniques_webgl",       "KHR_texture_basisu",
};
constexpr std::array kSupportedExtensions = {
    kDracoCompression,       kMeshoptCompression,
    "KHR_lights_punctual",   "KHR_materials_emissive_strength",
    "KHR_mesh_quantization", "KHR_node_visibility",
    "KHR_texture_transform",
};

template <class List, class Name> bool contains(const List& list, const Name& name) {
    return std::find(list.begin(), list.end(), name) != list.end();
}

// The compressions of geometry that other tools undo, with their commands.
constexpr std::array<std::pair<const char*, const char*>, 1> kCompressions = {{
    {"KHR_meshopt_compression", "gltfpack -noq -i IN.glb -o OUT.glb (1.0 or later)"},
}};

// Returns that an extension is not supported, and what to do.
std::string unsupported(const std::string& name) {
    for (const auto& [compression, command] : kCompressions)
        if (name == compression)
            return "the extension '" + name +
                   "', which is not supported; decompress the file: " + command;
    return "the extension '" + name + "', which is not supported; export it without";
}

// The callbacks by which tinygltf reaches files: buffers beside the document only.
struct FileAccess {
    explicit FileAccess(const std::string& documentPath) : folder(documentPath) {}
    SceneFolder folder;
    std::map<std::string, std::vector<uint64_t>> byteLengths; // of its buffers, in order
    std::map<std::string, int> readCounts;
    std::map<std::string, DataUri*> dataUris; // by the path that tinygltf makes of their URI
    std::string problem;                      // of the last file that could not be read
    uint64_t bytes = 0;
};

bool bufferExists(const std::string& path, void* userData) {
    // tinygltf also looks into the working folder, where a file of the same name would be another
    // one.
    const FileAccess& access = *static_cast<FileAccess*>(userData);
    if (!path.starts_with(access.folder.join("")))
        return false;
    if (access.byteLengths.contains(path) || access.dataUris.contains(path))
        return true; // readBuffer reports what is wrong with a buffer
    // Images are requested through the same callback, before it is known whether they are needed:
    // "not found" is only a warning.
    static constexpr std::array kImages = {".png", ".jpg",  ".jpeg", ".webp", ".ktx2",  ".ktx",
                                           ".dds", ".avif", ".gif",  ".bmp",  ".basis", ".tga"};
    if (contains(kImages, lowerCaseExtension(path)))
        return false;
    if (!access.folder.refusalOf(path).empty())
        return true; // readBuffer then reports why it is refused
    const std::string filePath = access.folder.filePathOf(path);
    std::error_code error;
    if (!std::filesystem::exists(filePath, error))
        return !access.folder.whyMissingBesideLink().empty(); // which readBuffer reports
    return whyNoInput(filePath, kMaxSceneFileBytes).empty();
}

std::string sameFilePath(const std::string& path, void*) {
    return path;
}

// Reads what lies at a path. Returns why that cannot be read; "" if it was.
std::string readPath(std::vector<unsigned char>& out, const std::string& path, FileAccess& access) {
    if (const auto data = access.dataUris.find(path); data != access.dataUris.end()) {
        out = std::move(data->second->bytes);
        return data->second->problem;
    }
    if (const std::string refusal = access.folder.refusalOf(path); !refusal.empty())
        return refusal;
    if (++access.readCounts[path] > kMaxReadsOfOneFile)
        return "is referred to by more than " + std::to_string(kMaxReadsOfOneFile) +
               " buffers; let them share one";
    std::error_code sizeError;
    const std::string filePath = access.folder.filePathOf(path);
    if (const std::string why = access.folder.whyNoFile(filePath); !why.empty())
        return why;
    uint64_t size = std::filesystem::file_size(filePath, sizeError);
    // A file may be longer than its buffer (glTF 2.0, sec. 3.6.1.1); tinygltf accepts no such file.
    if (const auto found = access.byteLengths.find(path); found != access.byteLengths.end()) {
        const auto buffer = size_t(access.readCounts[path] - 1);
        if (buffer < found->second.size()) {
            const uint64_t needed = found->second[buffer];
            if (!sizeError && size < needed)
                return "has " + std::to_string(size) + " bytes, but its buffer has " +
                       std::to_string(needed) + "; fetch or export it again";
            size = std::min(size, needed);
        }
    }
    errno = 0;
    std::ifstream stream(filePath, std::ios::binary);
    if (!stream)
        refuseTooManyFiles(filePath, errno);
    if (sizeError || !stream)
        return "cannot be read; check the disk";
    out.resize(size);
    stream.read(reinterpret_cast<char*>(out.data()), std::streamsize(size));
    if (uint64_t(stream.gcount()) != size)
        return "cannot be read completely; check the disk";
    access.bytes += size;
    return "";
}

bool readBuffer(std::vector<unsigned char>* out, std::string* error, const std::string& path,
                void* userData) {
    FileAccess& access = *static_cast<FileAccess*>(userData);
    *error = readPath(*out, path, access);
    if (error->empty())
        return true;
    access.problem = *error;
    return false;
}

bool writeNothing(std::string* error, const std::string&, const std::vector<unsigned char>&,
                  void*) {
    *error = "nothing is written";
    return false;
}

// Lets tinygltf read files through `access` only. Releases from 2.9 on ask for the size of a file
// first; readBuffer finds it, and what is wrong with the file.
template <class Loader, class Callbacks = tinygltf::FsCallbacks>
void useOwnFileAccess(Loader& loader, FileAccess& access) {
    Callbacks callbacks;
    callbacks.FileExists = bufferExists;
    callbacks.ExpandFilePath = sameFilePath;
    callbacks.ReadWholeFile = readBuffer;
    callbacks.WriteWholeFile = writeNothing;
    if constexpr (requires { callbacks.GetFileSizeInBytes; })
        callbacks.GetFileSizeInBytes = [](size_t* size, std::string*, const std::string&, void*) {
            *size = 1;
            return true;
        };
    callbacks.user_data = &access;
    if constexpr (requires { bool(loader.SetFsCallbacks(callbacks)); }) {
        if (!loader.SetFsCallbacks(callbacks)) // it would read by functions of its own
            throw std::logic_error("tinygltf refuses the functions that read files");
    } else {
        loader.SetFsCallbacks(callbacks);
    }
}

// Images in buffer views are found there when they are needed (nothing has checked the view yet);
// those in data URIs would be lost.
bool keepImage(tinygltf::Image* image, int, std::string*, std::string*, int, int,
               const unsigned char* bytes, int count, void*) {
    if (image->bufferView == -1 && count > 0)
        image->image.assign(bytes, bytes + count);
    return true;
}

// Returns the path of a URI, as tinygltf joins it.
std::string pathBeside(const FileAccess& access, const std::string& uri) {
    return access.folder.join(decodeUri(uri));
}

uint32_t loadUint32(const std::vector<unsigned char>& bytes, size_t offset) {
    return uint32_t(bytes[offset]) | uint32_t(bytes[offset + 1]) << 8 |
           uint32_t(bytes[offset + 2]) << 16 | uint32_t(bytes[offset + 3]) << 24;
}

struct GlbLayout {
    uint32_t jsonBytes = 0;
    uint32_t binaryBytes = 0;
};

// Source: glTF 2.0, sec. 4.4. tinygltf's own check of the second chunk ignores its header.
GlbLayout checkGlb(const Document& document, const std::vector<unsigned char>& bytes) {
    constexpr uint64_t kHeaderBytes = 12, kChunkHeaderBytes = 8;
    if (bytes.size() < kHeaderBytes + kChunkHeaderBytes)
        fail(document, "GLB header",
             "the file ends after " + std::to_string(bytes.size()) + " bytes");
    const uint32_t version = loadUint32(bytes, 4), length = loadUint32(bytes, 8);
    if (version != 2)
        fail(document, "GLB header",
             "version " + std::to_string(version) + "; only version 2 is supported");
    if (length > bytes.size())
        fail(document, "GLB header",
             "says " + std::to_string(length) + " bytes, but the file ends after " +
                 std::to_string(bytes.size()) + "; fetch it again");
    GlbLayout layout;
    layout.jsonBytes = loadUint32(bytes, 12);
    const uint64_t jsonEnd = kHeaderBytes + kChunkHeaderBytes + layout.jsonBytes;
    if (jsonEnd > length)
        fail(document, "GLB JSON chunk",
             std::to_string(layout.jsonBytes) + " bytes do not fit the file's " +
                 std::to_string(length));
    if (jsonEnd + kChunkHeaderBytes <= length) {
        layout.binaryBytes = loadUint32(bytes, jsonEnd);
        if (jsonEnd + kChunkHeaderBytes + layout.binaryBytes > length)
            fail(document, "GLB BIN chunk",
                 std::to_string(layout.binaryBytes) + " bytes do not fit the file's " +
                     std::to_string(length));
    } else if (jsonEnd != length) {
        fail(document, "GLB BIN chunk",
             "its header is cut short after " + std::to_string(length - jsonEnd) + " bytes");
    }
    return layout;
}

void checkExtensions(Document& document) {
    for (const std::string& name : document.model.extensionsRequired) {
        if (contains(kColorExtensions, name))
            ++document.ignoredMaterialExtensionCount;
        else if (!contains(kSupportedExtensions, name))
            fail(document, "extensionsRequired", "the file requires " + unsupported(name));
    }
    for (const std::string& name : document.model.extensionsUsed)
        if (!contains(kColorExtensions, name) && !contains(kSupportedExtensions, name) &&
            !contains(document.ignoredExtensions, name))
            document.ignoredExtensions.push_back(name);
}

std::string replaced(std::string text, std::string_view from, std::string_view to) {
    for (size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
        text.replace(at, from.size(), to);
    return text;
}

// Returns whether tinygltf speaks of a list or of the document, not of an element.
bool isOfNoElement(const std::string& said) {
    return said.find("does not contain an JSON object") != std::string::npos ||
           said.starts_with("\"asset\" object") || said.starts_with("Root element") ||
           said.starts_with("JSON string");
}

// Returns what tinygltf says last, in our words. Lines before it are of values that it replaced.
std::string reasonOf(const std::string& said) {
    std::string text = replaced(replaced(said, "\n in ", " in "), ". \n'", " in '");
    text.erase(text.find_last_not_of(" .\n") + 1);
    text.erase(0, text.rfind('\n') + 1);
    std::replace(text.begin(), text.end(), '\0', '?'); // it would end the message
    std::replace(text.begin(), text.end(), '`', '\'');
    for (const auto& [theirs, ours] : std::initializer_list<std::pair<const char*, const char*>>{
             {"' property is ", "' is "},
             {"' field is ", "' is "},
             {"does not contain an JSON object", "has something other than JSON objects"},
             {"\"asset\" object not found in .gltf or not an object type",
              "'version' is missing in the asset"},
             {"Root element is not a JSON object", "its JSON is no object"},
             {"JSON string too short", "its JSON is empty"}})
        text = replaced(std::move(text), theirs, ours);
    text = text.substr(0, text.find(" for image["));
    if (text.size() > 200)
        text = text.substr(0, 200) + "...";
    return text.empty() ? "cannot be read" : text;
}

// Returns the element that tinygltf could not read, the first that it has not: "accessors/3: ". ""
// if it read all.
std::string unreadElement(const tinygltf::Model& model, const JsonSummary& summary) {
    const std::array<size_t, kLists.size()> readCounts = {
        model.buffers.size(),    model.bufferViews.size(), model.accessors.size(),
        model.meshes.size(),     model.nodes.size(),       model.scenes.size(),
        model.materials.size(),  model.images.size(),      model.textures.size(),
        model.animations.size(), model.skins.size(),       model.samplers.size(),
        model.cameras.size()};
    for (size_t list = 0; list < kLists.size(); ++list)
        if (readCounts[list] < summary.elementCounts[list])
            return std::string(kLists[list]) + "/" + std::to_string(readCounts[list]) + ": ";
    return "";
}

// Returns what is wrong with the indices of primitives, which tinygltf checks before it reads
// nodes; "" if nothing is.
std::string indicesProblem(const tinygltf::Model& model) {
    for (size_t m = 0; m < model.meshes.size(); ++m)
        for (size_t p = 0; p < model.meshes[m].primitives.size(); ++p) {
            const int indices = model.meshes[m].primitives[p].indices;
            if (indices < 0)
                continue;
            const std::string place =
                "meshes/" + std::to_string(m) + "/primitives/" + std::to_string(p) + "/indices: ";
            if (size_t(indices) >= model.accessors.size())
                return place + "refers to accessor " + std::to_string(indices) + " of " +
                       std::to_string(model.accessors.size());
            const int view = model.accessors[size_t(indices)].bufferView;
            if (view < 0 || size_t(view) >= model.bufferViews.size())
                return place + "accessor " + std::to_string(indices) +
                       (view < 0 ? std::string(" has no buffer view")
                                 : " refers to buffer view " + std::to_string(view) + " of " +
                                       std::to_string(model.bufferViews.size()));
        }
    return "";
}

// Returns the message of tinygltf's reader of JSON in our words.
std::string jsonProblem(const std::string& said, std::string_view json) {
    const std::string number = "number overflow parsing ";
    if (const size_t at = said.find(number); at != std::string::npos)
        return "the number " + said.substr(at + number.size(), 60) + " is beyond 1.8e308";
    unsigned line = 0, column = 0;
    const size_t place = said.find("line ");
    if (place == std::string::npos ||
        std::sscanf(said.c_str() + place, "line %u, column %u", &line, &column) != 2)
        return "is not JSON; export the file again";
    size_t byte = 0;
    for (unsigned i = 1; i < line && byte < json.size(); ++i)
        byte = std::min(json.find('\n', byte), json.size() - 1) + 1;
    return "is not JSON at line " + std::to_string(line) + ", column " + std::to_string(column) +
           (column > 0 && isNoNumber(json, byte + column - 1)
                ? "; JSON has no NaN and no Infinity: write a number"
                : "; export the file again");
}

// Returns the buffer that tinygltf could not read, with its URI.
std::string unreadBuffer(const tinygltf::Model& model, const JsonSummary& summary) {
    const size_t buffer = model.buffers.size();
    const std::string uri =
        buffer < summary.buffers.size() ? summary.buffers[buffer].uri.substr(0, 80) : "";
    return "buffers/" + std::to_string(buffer) + " ('" + uri + "'): ";
}

// Cuts what a data URI holds to the length of its buffer, which may end in padding. Throws if it is
// shorter, or cannot be read.
void fitToBuffer(const Document& document, DataUri& data, uint64_t byteLength,
                 const std::string& place) {
    if (!data.problem.empty())
        fail(document, place, data.problem);
    if (data.bytes.size() < byteLength)
        fail(document, place,
             "its data URI has " + std::to_string(data.bytes.size()) +
                 " bytes, but its byteLength is " + std::to_string(byteLength) +
                 "; export the file again");
    data.bytes.resize(size_t(byteLength));
}

// Keeps why images within the text cannot be read, for materials that need them, and removes the
// URIs that stood for those images.
void takeImageProblems(Document& document, const FileAccess& access, const JsonSummary& summary) {
    if (summary.dataUris.empty())
        return;
    for (size_t i = 0; i < document.model.images.size(); ++i) {
        tinygltf::Image& image = document.model.images[i];
        if (image.uri.empty())
            continue;
        const auto data = access.dataUris.find(pathBeside(access, image.uri));
        if (data == access.dataUris.end())
            continue;
        image.uri.clear();
        if (!data->second->problem.empty())
            document.imageProblems[int(i)] = data->second->problem;
    }
}

/// Returns for each image the first one of the same source: a part of a buffer, or a file.
std::vector<int> firstImagesAlike(const tinygltf::Model& model) {
    std::map<std::tuple<int, size_t, size_t, std::string>, int> known;
    std::vector<int> first;
    for (size_t i = 0; i < model.images.size(); ++i) {
        const tinygltf::Image& image = model.images[i];
        const bool isInView =
            image.bufferView >= 0 && size_t(image.bufferView) < model.bufferViews.size();
        if (isInView) {
            const tinygltf::BufferView& view = model.bufferViews[size_t(image.bufferView)];
            first.push_back(
                known.try_emplace({view.buffer, view.byteOffset, view.byteLength, ""}, int(i))
                    .first->second);
        } else if (image.bufferView == -1 && image.image.empty() && !image.uri.empty()) {
            first.push_back(known.try_emplace({-1, 0, 0, image.uri}, int(i)).first->second);
        } else {
            first.push_back(int(i));
        }
    }
    return first;
}

} // namespace

void fail(const Document& document, const std::string& place, const std::string& problem) {
    throw Error(ErrorKind::kInput, printable(document.path + ": " + place + ": " + problem));
}

std::vector<uint8_t> readBeside(const Document& document, const std::string& uri,
                                const std::string& place) {
    FileAccess access(document.path);
    const std::string path = pathBeside(access, uri);
    std::vector<uint8_t> bytes;
    std::string error;
    if (readBuffer(&bytes, &error, path, &access))
        return bytes;
    fail(document, place, error);
}

Document loadDocument(const std::string& path, std::vector<uint8_t> bytes) {
    Document document;
    document.path = path;
    document.inputBytes = bytes.size();
    JsonSummary summary;
    struct {
        size_t from, bytes;
    } json{0, bytes.size()}; // its place in the file
    const bool isGlb = bytes.size() >= 4 && std::memcmp(bytes.data(), "glTF", 4) == 0;
    if (isGlb) {
        const GlbLayout layout = checkGlb(document, bytes);
        document.surplusBytes = bytes.size() - loadUint32(bytes, 8);
        json = {20, layout.jsonBytes};
        summary =
            screenJson(document, reinterpret_cast<char*>(bytes.data()) + 20, layout.jsonBytes);
        // tinygltf copies the BIN chunk into every buffer without a URI; the format allows one.
        const auto bufferCount = uint64_t(
            std::count_if(summary.buffers.begin(), summary.buffers.end(),
                          [](const JsonSummary::Buffer& buffer) { return !buffer.isAbsent; }));
        if (bufferCount > 1 &&
            (bufferCount - 1) * uint64_t(layout.binaryBytes) > 16 * bytes.size() + (64u << 20))
            fail(document, "buffers",
                 std::to_string(bufferCount) + " buffers over a BIN chunk of " +
                     std::to_string(layout.binaryBytes) + " bytes; one is meant to use it");
    } else {
        if (const std::optional<SceneKind> other = otherKindOf(path, bytes))
            refuseKind(path, *other, bytes);
        summary = screenJson(document, reinterpret_cast<char*>(bytes.data()), bytes.size());
    }

    FileAccess access(path);
    for (size_t i = 0; i < summary.dataUris.size(); ++i)
        access.dataUris[pathBeside(access, "data:" + std::to_string(i))] = &summary.dataUris[i];
    for (size_t i = 0; i < summary.buffers.size(); ++i) {
        const JsonSummary::Buffer& buffer = summary.buffers[i];
        const std::string place = "buffers/" + std::to_string(i);
        const std::string filePath = buffer.uri.empty() ? "" : pathBeside(access, buffer.uri);
        if (filePath.find('\0') != std::string::npos) // releases from 2.9 on read what is before it
            fail(document, place, access.folder.refusalOf(filePath));
        const auto data = access.dataUris.find(filePath);
        if (data != access.dataUris.end())
            fitToBuffer(document, *data->second, buffer.byteLength, place);
        else if (!buffer.uri.empty())
            access.byteLengths[filePath].push_back(buffer.byteLength);
    }
    tinygltf::TinyGLTF loader;
    useOwnFileAccess(loader, access);
    loader.SetImageLoader(keepImage, nullptr);
    std::string error, warning;
    bool isLoaded = false;
    try {
        isLoaded =
            isGlb ? loader.LoadBinaryFromMemory(&document.model, &error, &warning, bytes.data(),
                                                unsigned(bytes.size()), access.folder.path())
                  : loader.LoadASCIIFromString(&document.model, &error, &warning,
                                               reinterpret_cast<const char*>(bytes.data()),
                                               unsigned(bytes.size()), access.folder.path());
    } catch (const Error&) { // of readBuffer
        throw;
    } catch (const std::bad_alloc&) {
        throw Error(ErrorKind::kResource, path + ": not enough memory to parse the file");
    } catch (const std::exception& e) {
        error = std::string_view(e.what()).starts_with("[json.exception.") ? e.what() : "";
    }
    // A missing extension explains other errors best.
    checkExtensions(document);
    if (!isLoaded) {
        std::string reason;
        if (error.starts_with("[json.exception.type_error"))
            reason = unreadElement(document.model, summary) +
                     "has a value of another type than glTF gives it; export the file again";
        else if (error.starts_with("[json.exception."))
            reason =
                jsonProblem(error.substr(0, error.find('\n')),
                            {reinterpret_cast<const char*>(bytes.data()) + json.from, json.bytes});
        else if (error.find("File read error") != std::string::npos && !access.problem.empty())
            reason = unreadBuffer(document.model, summary) + access.problem;
        else if (error.find("'uri' is missing from non binary") != std::string::npos)
            reason = unreadElement(document.model, summary) +
                     "'uri' is missing, so it has no data; export the file again";
        else if (const std::string indices = indicesProblem(document.model); !indices.empty())
            reason = indices + "; export the file again";
        else
            reason = (isOfNoElement(error) ? "" : unreadElement(document.model, summary)) +
                     reasonOf(error) + "; export the file again";
        for (const std::string& name : document.model.extensionsUsed)
            if (!contains(kColorExtensions, name) && !contains(kSupportedExtensions, name))
                reason += "; it uses " + unsupported(name);
        fail(document, "not a readable glTF 2.0 file", reason);
    }
    const tinygltf::Asset& asset = document.model.asset;
    if (asset.version.rfind("2.", 0) != 0)
        fail(document, "asset.version",
             "'" + asset.version.substr(0, 20) + "'; only glTF 2 is supported");
    if (!asset.minVersion.empty() && asset.minVersion != "2.0")
        fail(document, "asset.minVersion",
             "'" + asset.minVersion.substr(0, 20) + "'; only glTF 2.0 is supported");
    document.inputBytes += access.bytes;
    takeImageProblems(document, access, summary);
    unpackMeshopt(document);
    unpackDraco(document);
    document.firstAlike = firstImagesAlike(document.model);
    return document;
}

} // namespace shadowdag::gltf
