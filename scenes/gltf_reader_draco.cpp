// SPDX-License-Identifier: Apache-2.0
// Unpacks primitives of KHR_draco_mesh_compression. The only file with Draco in it. Source:
// Khronos, glTF 2.0 extension KHR_draco_mesh_compression; Draco bitstream specification 2.2.
#include "scenes/gltf_reader.h"

#include <draco/compression/decode.h>
#include <draco/compression/point_cloud/point_cloud_decoder.h>
#include <draco/core/varint_decoding.h>
#include <draco/metadata/geometry_metadata.h>
#include <draco/metadata/metadata_decoder.h>

#include <cstring>
#include <memory>
#include <tuple>

namespace shadowdag::gltf {

namespace {

/// Returns the type of glTF components that are stored as Draco's; 0 for those that glTF lacks.
int componentTypeOf(draco::DataType type) {
    switch (type) {
    case draco::DT_INT8:
        return TINYGLTF_COMPONENT_TYPE_BYTE;
    case draco::DT_UINT8:
        return TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE;
    case draco::DT_INT16:
        return TINYGLTF_COMPONENT_TYPE_SHORT;
    case draco::DT_UINT16:
        return TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT;
    case draco::DT_UINT32:
        return TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
    case draco::DT_FLOAT32:
        return TINYGLTF_COMPONENT_TYPE_FLOAT;
    default:
        return 0;
    }
}

/// Returns the components of a primitive's attribute; 0 for those that are not read.
int componentCountOf(const std::string& attribute) {
    return attribute == "POSITION"                                                 ? 3
           : attribute.starts_with("TEXCOORD_")                                    ? 2
           : attribute.starts_with("JOINTS_") || attribute.starts_with("WEIGHTS_") ? 4
                                                                                   : 0;
}

/// Unpacks the primitives of one document; streams that several use are unpacked once.
class DracoUnpacker {
public:
    explicit DracoUnpacker(Document& document) : document_(document), unpacked_(document) {}

    void unpack(tinygltf::Primitive& primitive, const tinygltf::Value& extension,
                const std::string& place) {
        const uint64_t view = wholeNumber(document_, extension, "bufferView", place);
        const tinygltf::Value& ids = extension.Get("attributes");
        if (!ids.IsObject() || !ids.Has("POSITION"))
            fail(document_, place, "'attributes' has no POSITION");
        for (const std::string& name : ids.Keys())
            if (componentCountOf(name) > 0)
                primitive.attributes[name] =
                    attributeOf(view, wholeNumber(document_, ids, name.c_str(), place), name,
                                primitive.attributes, place);
        primitive.indices = indicesOf(view, place);
        primitive.mode = TINYGLTF_MODE_TRIANGLES; // strips, too, are stored as triangles
    }

private:
    /// Returns the mesh of a view. Throws for one that claims far more than its bytes hold, before
    /// Draco allocates it.
    const draco::Mesh& meshOf(uint64_t view, const std::string& place) {
        std::unique_ptr<draco::Mesh>& mesh = meshes_[view];
        if (mesh)
            return *mesh;
        const auto& views = document_.model.bufferViews;
        if (view >= views.size())
            fail(document_, place,
                 "refers to buffer view " + std::to_string(view) + " of " +
                     std::to_string(views.size()));
        const tinygltf::BufferView& source = views[view];
        const uint8_t* const bytes = partOfBuffer(document_, uint64_t(source.buffer),
                                                  source.byteOffset, source.byteLength, place);
        const char* const data = reinterpret_cast<const char*>(bytes);
        checkClaim(data, source.byteLength, place);
        draco::DecoderBuffer buffer;
        buffer.Init(data, source.byteLength);
        auto decoded = draco::Decoder().DecodeMeshFromBuffer(&buffer);
        if (!decoded.ok())
            fail(document_, place,
                 "Draco cannot unpack it: " + decoded.status().error_msg_string() +
                     "; the file is damaged");
        mesh = std::move(decoded).value();
        return *mesh;
    }

    void checkClaim(const char* data, size_t count, const std::string& place) {
        draco::DecoderBuffer buffer;
        buffer.Init(data, count);
        draco::DracoHeader header;
        if (!draco::PointCloudDecoder::DecodeHeader(&buffer, &header).ok())
            fail(document_, place, "its bytes are no Draco stream");
        if (header.encoder_type != draco::TRIANGULAR_MESH)
            fail(document_, place, "its Draco stream is a cloud of points, not a mesh");
        if (header.version_major != 2 || header.version_minor != 2)
            fail(document_, place,
                 "its Draco stream has version " + std::to_string(header.version_major) + "." +
                     std::to_string(header.version_minor) + "; glTF has 2.2");
        buffer.set_bitstream_version(DRACO_BITSTREAM_VERSION(2, 2));
        draco::GeometryMetadata metadata;
        bool isRead = (header.flags & METADATA_FLAG_MASK) == 0 ||
                      draco::MetadataDecoder().DecodeGeometryMetadata(&buffer, &metadata);
        uint32_t points = 0, faces = 0;
        uint8_t traversal = 0;
        if (header.encoder_method == draco::MESH_EDGEBREAKER_ENCODING)
            isRead = isRead && buffer.Decode(&traversal) && draco::DecodeVarint(&points, &buffer) &&
                     draco::DecodeVarint(&faces, &buffer);
        else
            isRead = isRead && draco::DecodeVarint(&faces, &buffer) &&
                     draco::DecodeVarint(&points, &buffer);
        if (!isRead)
            fail(document_, place, "its Draco stream ends too early");
        unpacked_.add(count, 12 * (uint64_t(points) + uint64_t(faces)), place);
    }

    int attributeOf(uint64_t view, uint64_t id, const std::string& name,
                    const std::map<std::string, int>& authored, const std::string& place) {
        const auto written = authored.find(name);
        const auto& accessors = document_.model.accessors;
        const bool isNormalized = written != authored.end() && written->second >= 0 &&
                                  size_t(written->second) < accessors.size() &&
                                  accessors[size_t(written->second)].normalized;
        const std::tuple key(view, id, componentCountOf(name), isNormalized);
        const auto known = attributes_.find(key);
        if (known != attributes_.end())
            return known->second;
        const draco::Mesh& mesh = meshOf(view, place);
        const draco::PointAttribute* const from =
            id <= UINT32_MAX ? mesh.GetAttributeByUniqueId(uint32_t(id)) : nullptr;
        if (from == nullptr)
            fail(document_, place, "its Draco stream has no attribute " + std::to_string(id));
        tinygltf::Accessor accessor;
        const int count = componentCountOf(name);
        accessor.type = count == 2   ? TINYGLTF_TYPE_VEC2
                        : count == 3 ? TINYGLTF_TYPE_VEC3
                                     : TINYGLTF_TYPE_VEC4;
        accessor.componentType = componentTypeOf(from->data_type());
        if (from->num_components() != count || accessor.componentType == 0)
            fail(document_, place,
                 name + " has " + std::to_string(from->num_components()) +
                     " components of Draco's type " + std::to_string(from->data_type()) +
                     ", which glTF does not have");
        accessor.normalized = isNormalized;
        const size_t elementBytes =
            size_t(count) * size_t(draco::DataTypeLength(from->data_type()));
        if (from->byte_stride() != int64_t(elementBytes))
            fail(document_, place, name + " has gaps in its Draco stream");
        std::vector<unsigned char> bytes(size_t(mesh.num_points()) * elementBytes);
        for (uint32_t p = 0; p < mesh.num_points(); ++p) {
            const draco::PointIndex point(p);
            if (!from->is_mapping_identity() && p >= from->indices_map_size())
                fail(document_, place, name + " lacks points in its Draco stream");
            const draco::AttributeValueIndex value = from->mapped_index(point);
            if (value.value() >= from->size())
                fail(document_, place, name + " lacks values in its Draco stream");
            from->GetValue(value, bytes.data() + p * elementBytes);
        }
        accessor.count = mesh.num_points();
        return attributes_[key] = append(accessor, std::move(bytes));
    }

    int indicesOf(uint64_t view, const std::string& place) {
        const auto known = indices_.find(view);
        if (known != indices_.end())
            return known->second;
        const draco::Mesh& mesh = meshOf(view, place);
        std::vector<unsigned char> bytes(size_t(mesh.num_faces()) * 3 * sizeof(uint32_t));
        for (uint32_t f = 0; f < mesh.num_faces(); ++f)
            for (size_t corner = 0; corner < 3; ++corner) {
                const uint32_t index = mesh.face(draco::FaceIndex(f))[corner].value();
                std::memcpy(bytes.data() + (size_t(f) * 3 + corner) * sizeof index, &index,
                            sizeof index);
            }
        tinygltf::Accessor accessor;
        accessor.type = TINYGLTF_TYPE_SCALAR;
        accessor.componentType = TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
        accessor.count = size_t(mesh.num_faces()) * 3;
        return indices_[view] = append(accessor, std::move(bytes));
    }

    /// Appends an accessor with its view and its buffer; returns its index.
    int append(tinygltf::Accessor accessor, std::vector<unsigned char> bytes) {
        tinygltf::Model& model = document_.model;
        tinygltf::Buffer buffer;
        buffer.data = std::move(bytes);
        tinygltf::BufferView view;
        view.buffer = int(model.buffers.size());
        view.byteLength = buffer.data.size();
        accessor.bufferView = int(model.bufferViews.size());
        model.buffers.push_back(std::move(buffer));
        model.bufferViews.push_back(std::move(view));
        model.accessors.push_back(std::move(accessor));
        return int(model.accessors.size()) - 1;
    }

    Document& document_;
    UnpackedBytes unpacked_;
    std::map<uint64_t, std::unique_ptr<draco::Mesh>> meshes_; // by buffer view
    std::map<uint64_t, int> indices_;                         // accessors, by buffer view
    /// Accessors, by buffer view, attribute, components and whether integers are normalised.
    std::map<std::tuple<uint64_t, uint64_t, int, bool>, int> attributes_;
};

} // namespace

void unpackDraco(Document& document) {
    DracoUnpacker unpacker(document);
    for (size_t m = 0; m < document.model.meshes.size(); ++m)
        for (size_t p = 0; p < document.model.meshes[m].primitives.size(); ++p) {
            tinygltf::Primitive& primitive = document.model.meshes[m].primitives[p];
            const auto found = primitive.extensions.find(kDracoCompression);
            if (found != primitive.extensions.end())
                unpacker.unpack(primitive, found->second,
                                "meshes/" + std::to_string(m) + "/primitives/" + std::to_string(p) +
                                    "/extensions/" + kDracoCompression);
        }
}

} // namespace shadowdag::gltf
