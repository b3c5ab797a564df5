// SPDX-License-Identifier: Apache-2.0
#include "scenes/gltf_reader.h"

#include <cmath>
#include <cstring>

namespace shadowdag::gltf {

namespace {

// An honest file of quantised strips grows by a factor of 16 when it is read (a one-byte index
// becomes a triangle of three four-byte indices and a material); four times that, and some room for
// tiny files.
constexpr uint64_t kGrowthLimit = 64;
constexpr uint64_t kFreeBytes = 16u << 20;
// Of that, zeros of accessors without a buffer view: displacements of sparse morph targets are 20
// times the file where a face has fifty that move a hundredth of it each.
constexpr uint64_t kZeroGrowthLimit = 32;
// Four times what a scene's textures may have: of those of one colour and of masks nothing stays.
constexpr uint64_t kTexelLimit = 64, kFreeTexels = 4 * kMaxSceneTexels;

size_t componentBytes(int componentType) {
    switch (componentType) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
        return 1;
    case TINYGLTF_COMPONENT_TYPE_SHORT:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
        return 2;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
    case TINYGLTF_COMPONENT_TYPE_FLOAT:
        return 4;
    default:
        return 0; // INT and DOUBLE, which tinygltf lets through, are not glTF
    }
}

int vectorComponentCount(int type) {
    switch (type) {
    case TINYGLTF_TYPE_SCALAR:
        return 1;
    case TINYGLTF_TYPE_VEC2:
        return 2;
    case TINYGLTF_TYPE_VEC3:
        return 3;
    case TINYGLTF_TYPE_VEC4:
        return 4;
    case TINYGLTF_TYPE_MAT4: // in floats alone, whose columns need no padding
        return 16;
    default:
        return 0;
    }
}

template <class T> T load(const uint8_t* p) {
    T value;
    std::memcpy(&value, p, sizeof value); // files with unaligned accessors exist
    return value;
}

// Source: glTF 2.0, sec. 3.11 (animation sampler outputs) and KHR_mesh_quantization: the decoding
// formulas.
float loadFloat(const uint8_t* p, int componentType, bool isNormalized) {
    switch (componentType) {
    case TINYGLTF_COMPONENT_TYPE_BYTE: {
        const float v = load<int8_t>(p);
        return isNormalized ? std::fmax(v / 127.0f, -1.0f) : v;
    }
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE: {
        const float v = load<uint8_t>(p);
        return isNormalized ? v / 255.0f : v;
    }
    case TINYGLTF_COMPONENT_TYPE_SHORT: {
        const float v = load<int16_t>(p);
        return isNormalized ? std::fmax(v / 32767.0f, -1.0f) : v;
    }
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT: {
        const float v = load<uint16_t>(p);
        return isNormalized ? v / 65535.0f : v;
    }
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
        return float(load<uint32_t>(p));
    default:
        return load<float>(p);
    }
}

uint32_t loadUnsigned(const uint8_t* p, int componentType) {
    switch (componentType) {
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
        return load<uint8_t>(p);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
        return load<uint16_t>(p);
    default:
        return load<uint32_t>(p);
    }
}

bool isUnsignedType(int componentType) {
    return componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE ||
           componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT ||
           componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
}

} // namespace

AccessorReader::AccessorReader(const Document& document)
    : document_(document), budgetBytes_(kFreeBytes + kGrowthLimit * document.inputBytes) {}

void AccessorReader::charge(uint64_t bytes, const std::string& place) {
    const uint64_t budget = budgetBytes_ + kGrowthLimit * besideBytes_;
    if (bytes > budget - usedBytes_)
        fail(document_, place,
             "the file of " + std::to_string(document_.inputBytes + besideBytes_) +
                 " bytes, with those beside it, declares more than " + std::to_string(budget) +
                 " bytes of content; its counts are wrong");
    usedBytes_ += bytes;
}

void AccessorReader::checkTexels(uint64_t besideBytes, const std::string& place) {
    besideBytes_ += besideBytes;
    const uint64_t most = kFreeTexels + kTexelLimit * (document_.inputBytes + besideBytes_);
    if (texelCount_ > most)
        fail(document_, place,
             "the images before it have " + std::to_string(texelCount_) + " texels, and " +
                 std::to_string(most) +
                 " are the most that are decoded for files of this size; scale them down, or use "
                 "fewer");
}

const tinygltf::Accessor& AccessorReader::accessorAt(int accessor, const std::string& place) const {
    const auto& accessors = document_.model.accessors;
    if (accessor < 0 || size_t(accessor) >= accessors.size())
        fail(document_, place,
             "refers to accessor " + std::to_string(accessor) + " of " +
                 std::to_string(accessors.size()));
    const tinygltf::Accessor& a = accessors[size_t(accessor)];
    if (a.count == 0)
        fail(document_, place, "accessor " + std::to_string(accessor) + " has count 0");
    if (componentBytes(a.componentType) == 0)
        fail(document_, place,
             "accessor " + std::to_string(accessor) + " has component type " +
                 std::to_string(a.componentType) + ", which glTF does not have");
    return a;
}

AccessorReader::Source AccessorReader::source(int bufferView, uint64_t byteOffset, uint64_t count,
                                              size_t elementBytes, bool isStrideAllowed,
                                              const std::string& place) const {
    const auto& views = document_.model.bufferViews;
    if (bufferView < 0 || size_t(bufferView) >= views.size())
        fail(document_, place,
             "refers to buffer view " + std::to_string(bufferView) + " of " +
                 std::to_string(views.size()));
    const tinygltf::BufferView& view = views[size_t(bufferView)];
    const std::string viewName = "buffer view " + std::to_string(bufferView);
    const auto& buffers = document_.model.buffers;
    if (view.buffer < 0 || size_t(view.buffer) >= buffers.size())
        fail(document_, place,
             viewName + " refers to buffer " + std::to_string(view.buffer) + " of " +
                 std::to_string(buffers.size()));
    const std::vector<unsigned char>& bytes = buffers[size_t(view.buffer)].data;
    // Written so that no sum or product of the file's numbers can wrap.
    if (view.byteOffset > bytes.size() || view.byteLength > bytes.size() - view.byteOffset)
        fail(document_, place,
             viewName + " (offset " + std::to_string(view.byteOffset) + ", length " +
                 std::to_string(view.byteLength) + ") ends beyond buffer " +
                 std::to_string(view.buffer) + " of " + std::to_string(bytes.size()) + " bytes");
    const size_t stride = isStrideAllowed && view.byteStride != 0 ? view.byteStride : elementBytes;
    if (stride < elementBytes)
        fail(document_, place,
             viewName + " has stride " + std::to_string(stride) + ", less than an element of " +
                 std::to_string(elementBytes) + " bytes");
    const bool fits = byteOffset <= view.byteLength &&
                      elementBytes <= view.byteLength - byteOffset &&
                      count - 1 <= (view.byteLength - byteOffset - elementBytes) / stride;
    if (!fits)
        fail(document_, place,
             std::to_string(count) + " elements of stride " + std::to_string(stride) +
                 " at offset " + std::to_string(byteOffset) + " end beyond " + viewName + " of " +
                 std::to_string(view.byteLength) + " bytes");
    return {bytes.data() + view.byteOffset + byteOffset, stride};
}

std::pair<const uint8_t*, size_t> AccessorReader::bytesOf(int bufferView,
                                                          const std::string& place) const {
    const auto& views = document_.model.bufferViews;
    const size_t count = bufferView >= 0 && size_t(bufferView) < views.size()
                             ? views[size_t(bufferView)].byteLength
                             : 1; // source states the problem
    if (count == 0)
        fail(document_, place, "buffer view " + std::to_string(bufferView) + " is empty");
    return {source(bufferView, 0, 1, count, false, place).data, count};
}

// Calls store(element, pointer to its components or null for zeros), the dense elements first and
// then the sparse ones over them.
template <class Store>
void AccessorReader::visit(const tinygltf::Accessor& a, int componentCount,
                           const std::string& place, const Store& store) const {
    const size_t elementBytes = componentBytes(a.componentType) * size_t(componentCount);
    if (a.bufferView >= 0) {
        const Source dense = source(a.bufferView, a.byteOffset, a.count, elementBytes, true, place);
        for (size_t i = 0; i < a.count; ++i)
            store(i, dense.data + i * dense.stride);
    } else {
        for (size_t i = 0; i < a.count; ++i)
            store(i, nullptr);
    }
    if (!a.sparse.isSparse)
        return;
    const auto& sparse = a.sparse;
    if (sparse.count < 1 || size_t(sparse.count) > a.count)
        fail(document_, place,
             "a sparse accessor replaces " + std::to_string(sparse.count) + " of " +
                 std::to_string(a.count) + " elements");
    if (!isUnsignedType(sparse.indices.componentType))
        fail(document_, place,
             "sparse indices have component type " + std::to_string(sparse.indices.componentType) +
                 "; an unsigned integer type is needed");
    if (sparse.indices.byteOffset < 0 || sparse.values.byteOffset < 0)
        fail(document_, place,
             "a sparse accessor has byte offset " +
                 std::to_string(std::min(sparse.indices.byteOffset, sparse.values.byteOffset)));
    const Source indices = source(
        sparse.indices.bufferView, uint64_t(sparse.indices.byteOffset), uint64_t(sparse.count),
        componentBytes(sparse.indices.componentType), false, place + " (sparse indices)");
    const Source values =
        source(sparse.values.bufferView, uint64_t(sparse.values.byteOffset), uint64_t(sparse.count),
               elementBytes, false, place + " (sparse values)");
    for (size_t i = 0; i < size_t(sparse.count); ++i) {
        const uint32_t element =
            loadUnsigned(indices.data + i * indices.stride, sparse.indices.componentType);
        if (element >= a.count)
            fail(document_, place,
                 "sparse index " + std::to_string(element) + " is not below the count " +
                     std::to_string(a.count));
        store(element, values.data + i * values.stride);
    }
}

// Counts the elements of an accessor, before memory is taken for them.
void AccessorReader::chargeElements(int accessor, uint64_t elementBytes, const std::string& place) {
    const tinygltf::Accessor& a = accessorAt(accessor, place);
    const uint64_t bytes =
        a.count > UINT64_MAX / elementBytes ? UINT64_MAX : a.count * elementBytes;
    charge(bytes, place);
    if (a.bufferView >= 0)
        return;
    zeroBytes_ += bytes;
    const uint64_t most = kFreeBytes + kZeroGrowthLimit * document_.inputBytes;
    if (zeroBytes_ > most)
        fail(document_, place,
             "accessor " + std::to_string(accessor) + " has no buffer view, so that its " +
                 std::to_string(a.count) + " elements are zeros, and such zeros may take " +
                 std::to_string(most) + " bytes in a file of " +
                 std::to_string(document_.inputBytes) + "; give them data");
}

// Writes count * componentCount floats of the accessor.
void AccessorReader::fill(int accessor, int componentCount, const std::string& place,
                          float* values) const {
    const tinygltf::Accessor& a = accessorAt(accessor, place);
    const size_t bytes = componentBytes(a.componentType);
    visit(a, componentCount, place, [&](size_t element, const uint8_t* data) {
        for (int c = 0; c < componentCount; ++c) {
            const float v =
                data ? loadFloat(data + size_t(c) * bytes, a.componentType, a.normalized) : 0.0f;
            if (!std::isfinite(v))
                fail(document_, place,
                     "element " + std::to_string(element) + " of accessor " +
                         std::to_string(accessor) + " is " + std::to_string(v));
            values[element * size_t(componentCount) + size_t(c)] = v;
        }
    });
}

// Throws unless the accessor's elements have this many components.
void AccessorReader::requireComponents(int accessor, int componentCount,
                                       const std::string& place) const {
    const tinygltf::Accessor& a = accessorAt(accessor, place);
    if (vectorComponentCount(a.type) != componentCount)
        fail(document_, place,
             "accessor " + std::to_string(accessor) + " has " +
                 std::to_string(vectorComponentCount(a.type)) + " components an element, not " +
                 std::to_string(componentCount));
}

std::vector<float> AccessorReader::readFloats(int accessor, int componentCount,
                                              const std::string& place) {
    requireComponents(accessor, componentCount, place);
    chargeElements(accessor, uint64_t(componentCount) * sizeof(float), place);
    std::vector<float> values(accessorAt(accessor, place).count * size_t(componentCount));
    fill(accessor, componentCount, place, values.data());
    return values;
}

const std::vector<float>& AccessorReader::sharedFloats(int accessor, int componentCount,
                                                       const std::string& place) {
    const std::pair key(accessor, componentCount);
    const auto known = floats_.find(key);
    return known != floats_.end()
               ? known->second
               : floats_.emplace(key, readFloats(accessor, componentCount, place)).first->second;
}

const std::vector<glm::vec3>& AccessorReader::readPositions(int accessor,
                                                            const std::string& place) {
    const auto known = positions_.find(accessor);
    if (known != positions_.end())
        return known->second;
    requireComponents(accessor, 3, place);
    chargeElements(accessor, sizeof(glm::vec3), place);
    std::vector<glm::vec3> positions(accessorAt(accessor, place).count);
    fill(accessor, 3, place, &positions[0].x);
    for (size_t i = 0; i < positions.size(); ++i) {
        if (!isWithinReach(positions[i]))
            fail(document_, place,
                 "element " + std::to_string(i) + " of accessor " + std::to_string(accessor) +
                     " is " + pointText(positions[i]) +
                     ", not within 1e9 of the origin; scale the mesh down");
    }
    return positions_.emplace(accessor, std::move(positions)).first->second;
}

std::vector<uint32_t> AccessorReader::readIndices(int accessor, const std::string& place) {
    const tinygltf::Accessor& a = accessorAt(accessor, place);
    if (a.type != TINYGLTF_TYPE_SCALAR || !isUnsignedType(a.componentType))
        fail(document_, place,
             "indices need a SCALAR accessor of an unsigned integer type; accessor " +
                 std::to_string(accessor) + " has component type " +
                 std::to_string(a.componentType));
    chargeElements(accessor, sizeof(uint32_t), place);
    std::vector<uint32_t> indices(a.count);
    visit(a, 1, place, [&](size_t element, const uint8_t* data) {
        indices[element] = data ? loadUnsigned(data, a.componentType) : 0;
    });
    return indices;
}

} // namespace shadowdag::gltf
