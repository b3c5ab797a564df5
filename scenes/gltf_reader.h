// SPDX-License-Identifier: Apache-2.0
// The parts of the glTF reader: loading a document through tinygltf, and reading its accessors with
// every bound checked. Included by gltf_reader*.cpp only, the files that use tinygltf.
#pragma once

#include "scenes/color_image.h"
#include "scenes/gltf.h"
#include "scenes/png_alpha.h"

#include <glm/glm.hpp>
#include <tiny_gltf.h>

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace shadowdag::gltf {

/// The part of a file that tinygltf understood. tinygltf accepts indices out of range, cycles,
/// overlong accessors and non-finite numbers, so nothing in `model` is trusted.
struct Document {
    std::string path;
    tinygltf::Model model;
    std::vector<OpacityMap> opacityMaps;        ///< one a material; empty: a glTF file has none
    std::vector<int> firstAlike;                ///< of each image: the first of the same source
    std::map<int, std::string> imageProblems;   ///< of images: why their data URI cannot be read
    uint64_t inputBytes = 0;                    ///< of the file and the buffers beside it
    uint32_t ignoredMaterialExtensionCount = 0; ///< required ones that only change colour
    uint64_t surplusBytes = 0;                  ///< of a .glb after the length that it states
    std::vector<std::string> ignoredExtensions; ///< used ones that nothing here knows of
};

/// The compressions of geometry that are undone when a document is loaded.
constexpr const char* kMeshoptCompression = "EXT_meshopt_compression";
constexpr const char* kDracoCompression = "KHR_draco_mesh_compression";

/// Parses a .glb or .gltf (distinguished by content) and reads the buffers it refers to. Compressed
/// geometry is unpacked. Images within the
/// text are kept as Image::image, undecoded; others are not read. Throws Error kInput for a file
/// that is not glTF 2.0, is truncated, requires an unsupported extension, or nests or counts beyond
/// any reasonable limit.
/// @param path names the file and its folder; `bytes` are its content
Document loadDocument(const std::string& path, std::vector<uint8_t> bytes);

/// Unpacks the buffer views of EXT_meshopt_compression: each is then one of a buffer of its own.
/// Throws Error kInput for a view that cannot be unpacked.
void unpackMeshopt(Document& document);

/// Unpacks the primitives of KHR_draco_mesh_compression: indices, positions, texture coordinates,
/// joints and their weights become accessors, in buffers of their own. Throws Error kInput for one
/// that cannot be unpacked.
void unpackDraco(Document& document);

/// Returns an object's member that is a whole number from 0 to 2^53, or `otherwise` if it has none
/// of that name. Throws Error kInput for another value, and without `otherwise` for none.
uint64_t wholeNumber(const Document& document, const tinygltf::Value& object, const char* key,
                     const std::string& place, std::optional<uint64_t> otherwise = {});

/// Returns a part of a buffer of the document. Throws Error kInput if it ends beyond the buffer.
const uint8_t* partOfBuffer(const Document& document, uint64_t buffer, uint64_t byteOffset,
                            uint64_t byteLength, const std::string& place);

/// Counts bytes that were unpacked from others. Throws Error kInput when they are far more than any
/// geometry gives, because small files could take all memory else.
class UnpackedBytes {
public:
    explicit UnpackedBytes(Document& document)
        : document_(document), inputBytes_(document.inputBytes) {}
    /// @param from packed bytes, to: what they claim to become
    void add(uint64_t from, uint64_t to, const std::string& place);

private:
    Document& document_;
    uint64_t inputBytes_; ///< packed ones may be referred to again and again
    uint64_t from_ = 0, to_ = 0;
};

/// Throws Error kInput: "FILE: place: problem".
[[noreturn]] void fail(const Document& document, const std::string& place,
                       const std::string& problem);

/// Returns the content of a file that a document names by URI. Throws Error kInput when it lies
/// outside of the document's folder or cannot be read.
std::vector<uint8_t> readBeside(const Document& document, const std::string& uri,
                                const std::string& place);

/// Reads accessors of one document. Counts what it returns, and refuses a file whose content would
/// be far larger than the file.
class AccessorReader {
public:
    explicit AccessorReader(const Document& document);

    /// Returns count * componentCount floats; integers are normalised when the accessor says so,
    /// else converted. `place` names the place in messages. All returned values are finite.
    std::vector<float> readFloats(int accessor, int componentCount, const std::string& place);
    /// Returns the same, read and counted once however many primitives share it; the reference
    /// stays valid for the reader's life.
    const std::vector<float>& sharedFloats(int accessor, int componentCount,
                                           const std::string& place);
    /// Returns the positions of a VEC3 accessor; the reference stays valid for the reader's life.
    const std::vector<glm::vec3>& readPositions(int accessor, const std::string& place);
    /// Returns a SCALAR accessor of an unsigned integer type.
    std::vector<uint32_t> readIndices(int accessor, const std::string& place);
    /// Returns the bytes of a buffer view; they are the document's.
    std::pair<const uint8_t*, size_t> bytesOf(int bufferView, const std::string& place) const;
    /// Adds to the count of returned content. Throws when it passes the limit.
    void charge(uint64_t bytes, const std::string& place);
    /// Adds the texels of an image that was decoded.
    void addTexels(uint64_t count) { texelCount_ += count; }
    /// Throws when the images that were decoded have more texels than any scene's: a few KB of PNG
    /// or JPEG may hold as many as kMaxMaskTexels, each of which takes time.
    /// @param besideBytes of the image's own file, which is not part of Document::inputBytes
    void checkTexels(uint64_t besideBytes, const std::string& place);

private:
    struct Source {
        const uint8_t* data; // null: zeros
        size_t stride;
    };
    const tinygltf::Accessor& accessorAt(int accessor, const std::string& place) const;
    Source source(int bufferView, uint64_t byteOffset, uint64_t count, size_t elementBytes,
                  bool isStrideAllowed, const std::string& place) const;
    void fill(int accessor, int componentCount, const std::string& place, float* values) const;
    void requireComponents(int accessor, int componentCount, const std::string& place) const;
    void chargeElements(int accessor, uint64_t elementBytes, const std::string& place);
    template <class Store>
    void visit(const tinygltf::Accessor& accessor, int componentCount, const std::string& place,
               const Store& store) const;

    const Document& document_;
    uint64_t budgetBytes_;
    uint64_t usedBytes_ = 0, texelCount_ = 0, besideBytes_ = 0;
    uint64_t zeroBytes_ = 0; // of usedBytes_: of accessors without a buffer view
    std::map<int, std::vector<glm::vec3>> positions_;
    std::map<std::pair<int, int>, std::vector<float>> floats_; // by accessor, components
};

/// How texture coordinates of a material are read.
struct UvMapping {
    int texCoord = 0; ///< the set of texture coordinates
    glm::dmat3 uvFromAuthored{1.0};
    bool operator==(const UvMapping&) const = default;
};

/// How a material uses its base colour texture.
struct TextureUse {
    size_t texture = 0; ///< of the document
    int image = kNone;  ///< kNone: only an extension knows it, and what follows is not read
    MaskWrap wrapU = MaskWrap::kRepeat, wrapV = MaskWrap::kRepeat;
    bool isNearest = false; ///< magnified texels have sharp edges
    UvMapping uv;
};

/// Returns how a material uses its base colour texture, or nothing if it has none. Throws Error
/// kInput for what does not exist.
std::optional<TextureUse> readBaseColorUse(const Document& document, size_t material);

/// Returns the same of its opacity map.
std::optional<TextureUse> readOpacityUse(const Document& document, size_t material);

/// The bytes of an image as stored in its file.
struct ImageBytes {
    const uint8_t* data = nullptr;
    size_t count = 0;
    std::vector<uint8_t> own; ///< behind data, when they were read for this
};

/// Returns the place of an image for messages, with its URI or name.
std::string imagePlace(const Document& document, int image);

/// Returns the bytes of an image; those in a buffer are the document's. Throws Error kInput when
/// they are missing.
ImageBytes readImageBytes(const Document& document, const AccessorReader& accessors, int image);

/// Returns the image of these bytes as readColorImage and readPngAlpha do, and counts its texels;
/// of one that is damaged as many as its bytes may hold. Throws Error kInput, "FILE: place:
/// problem", too where a scene's images have too many (AccessorReader::checkTexels).
ColorImage decodeColors(const Document& document, AccessorReader& accessors,
                        const ImageBytes& bytes, const std::string& place);
AlphaImage decodeAlpha(const Document& document, AccessorReader& accessors, const ImageBytes& bytes,
                       const std::string& place);

/// How a material is cut out.
struct MaterialMask {
    int mask = kNone;     ///< of those that were read; kNone: opaque
    bool needsUv = false; ///< it has a texture
    UvMapping uv;
};

struct MaterialMasks {
    std::vector<MaterialMask> materials; ///< one a material of the document
    uint64_t unreadableCount = 0;        ///< masks taken as opaque: neither PNG nor JPEG
    uint64_t unusedAlphaCount = 0;       ///< opaque materials whose colours have alpha
};

/// Appends the masks of all materials of alphaMode MASK to `masks`, equal ones once, and returns
/// which material has which: by the alpha of its base colour texture or by its opacity map. Images
/// are decoded one at a time. Throws Error kInput naming the image
/// that is missing or damaged.
MaterialMasks readMaterialMasks(const Document& document, AccessorReader& accessors,
                                std::vector<AlphaMask>& masks);

/// How a material is coloured.
struct MaterialTexture {
    int texture = kNone;   ///< of those that were read; kNone: none, or all of one colour
    glm::vec3 color{1.0f}; ///< of a texture that is all of one colour, linear
    UvMapping uv;
};

struct MaterialTextures {
    std::vector<MaterialTexture> materials; ///< one a material of the document
    std::vector<uint8_t> isTextureUsed;     ///< one a texture: a base colour
    std::vector<std::string> warnings;      ///< textures that are not shown, and why
};

/// Appends the base colour textures of all materials to `textures`, equal ones once, and returns
/// which material has which. Images are decoded one at a time; those that are missing, damaged, of
/// another format than PNG and JPEG, beyond kMaxSceneTexels, or of a material whose mask has other
/// texture coordinates, are left out with a warning. Throws Error kInput for a material that refers
/// to what does not exist.
MaterialTextures readBaseColorTextures(const Document& document, AccessorReader& accessors,
                                       const MaterialMasks& masks, TextureSet& textures);

/// The accessors that deform the vertices of a primitive.
struct DeformAccessors {
    std::vector<int> joints, weights; ///< of each set of four joints
    std::vector<int> targets;         ///< displacements; kNone: a target without any
    bool operator==(const DeformAccessors&) const = default;
};

/// Returns those of a primitive; joints only if the document has skins. Throws Error kInput where
/// sets of joints and of weights do not pair.
DeformAccessors readDeformAccessors(const Document& document, const tinygltf::Primitive& primitive,
                                    const std::string& place);

/// Appends joints, their weights and displacements of the vertices in use to a mesh, whose
/// jointsPerVertex and count of morph targets are set. A vertex without weights follows the first
/// joint. Throws Error kInput for values that no joint or weight can have.
/// @param vertexCount of the primitive's accessors
void appendDeformation(const Document& document, AccessorReader& accessors,
                       const DeformAccessors& from, size_t vertexCount,
                       const std::vector<uint32_t>& used, const std::string& place, Mesh& mesh);

/// Returns all skins. Throws Error kInput for a joint that does not exist and for matrices that
/// place nothing.
std::vector<Skin> readSkins(const Document& document, AccessorReader& accessors);

} // namespace shadowdag::gltf
