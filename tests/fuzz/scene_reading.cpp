// SPDX-License-Identifier: Apache-2.0
#include "tests/fuzz/scene_reading.h"

#include "scenes/png_alpha.h"

namespace shadowdag::fuzz {

test::GltfParts everythingFile() {
    const std::vector<uint8_t> png =
        writePngMask({4, 4, MaskWrap::kRepeat, MaskWrap::kRepeat, {0x0, 0xf, 0xa, 0x5}});
    test::GltfParts parts = test::triangleFile();
    parts
        .append<uint8_t>({2, 0, 0, 0})           // 44: sparse index
        .append<float>({7, 8, 9})                // 48: sparse value
        .append<float>({0, 1})                   // 60: key times
        .append<float>({0, 0, 0, 1, 0, 1, 0, 0}) // 68: rotations
        .append<float>({0, 0, 1, 0, 0, 1})       // 100: texture coordinates
        .append<uint8_t>(png);                   // 124: image
    const std::string imageBytes = std::to_string(png.size());
    parts.set("buffers", "[{\"byteLength\":" + std::to_string(parts.binary.size()) + "}]")
        .set(
            "bufferViews",
            R"([{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":6},)"
            R"({"buffer":0,"byteOffset":44,"byteLength":1},{"buffer":0,"byteOffset":48,"byteLength":12},)"
            R"({"buffer":0,"byteOffset":60,"byteLength":8},{"buffer":0,"byteOffset":68,"byteLength":32},)"
            R"({"buffer":0,"byteOffset":100,"byteLength":24},{"buffer":0,"byteOffset":124,"byteLength":)" +
                imageBytes + "}]")
        .set("accessors",
             R"([{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","sparse":{"count":1,)"
             R"("indices":{"bufferView":2,"componentType":5121},"values":{"bufferView":3}}},)"
             R"({"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"},)"
             R"({"bufferView":4,"componentType":5126,"count":2,"type":"SCALAR"},)"
             R"({"bufferView":5,"componentType":5126,"count":2,"type":"VEC4"},)"
             R"({"bufferView":6,"componentType":5126,"count":3,"type":"VEC2"}])")
        .set(
            "meshes",
            R"([{"primitives":[{"attributes":{"POSITION":0,"TEXCOORD_0":4},"indices":1,"material":0}]}])")
        .set("images", R"([{"bufferView":7,"mimeType":"image/png"}])")
        .set("samplers", R"([{"wrapS":33071,"wrapT":33648,"magFilter":9728}])")
        .set("textures", R"([{"source":0,"sampler":0}])")
        .set("materials",
             R"([{"alphaMode":"MASK","alphaCutoff":0.5,"pbrMetallicRoughness":{"baseColorFactor":)"
             R"([1,0.5,0.25,1],"baseColorTexture":{"index":0,"texCoord":0,"extensions":)"
             R"({"KHR_texture_transform":{"offset":[0,0.5],"scale":[2,1],"rotation":1}}}}}])")
        .set("extensionsUsed", R"(["KHR_lights_punctual","KHR_texture_transform"])")
        .set(
            "extensions",
            R"({"KHR_lights_punctual":{"lights":[{"type":"spot","range":3,"intensity":4,)"
            R"("color":[1,1,0],"spot":{"innerConeAngle":0.1,"outerConeAngle":0.5}},{"type":"point"}]}})")
        .set("cameras", R"([{"type":"perspective","perspective":{"yfov":1,"znear":0.5}}])")
        .set(
            "nodes",
            R"([{"children":[1,2],"rotation":[0,0,0,1]},{"mesh":0,"scale":[1,-2,1]},)"
            R"({"camera":0,"extensions":{"KHR_lights_punctual":{"light":0}},"translation":[0,1,5]}])")
        .set("animations", R"([{"channels":[{"sampler":0,"target":{"node":0,"path":"rotation"}}],)"
                           R"("samplers":[{"input":2,"output":3,"interpolation":"STEP"}]}])");
    return parts;
}

} // namespace shadowdag::fuzz
