// SPDX-License-Identifier: Apache-2.0
#include "tools/workspace/ray_set.h"

#include "cuda/error.h"
#include "scenes/content_hash.h"
#include "scenes/output_file.h"
#include "tools/settings/json_file.h"

#include <algorithm>
#include <cmath>

namespace shadowdag {

namespace {

constexpr uint32_t kTile = 16; ///< pixels on a side

template <class T>
NamedArray arrayOf(const char* name, ArrayType type, const std::vector<T>& values,
                   uint32_t columns = 1) {
    static_assert(sizeof(T) % 4 == 0);
    return makeArray(name, type, values.data(), values.size(), columns);
}

/// What makes a set: all arrays but "about" and the id itself.
constexpr const char* kHashedArrays[] = {
    "position", "normal",   "receiver",     "pixel",    "light_point", "pair_sample", "pair_light",
    "vertex",   "triangle", "triangle_cut", "cut_mask", "cut_uv",      "mask",        "mask_words"};

/// Takes the arrays of a file.
class SetReader {
public:
    SetReader(const std::vector<NamedArray>& arrays, const std::string& path)
        : arrays_(arrays), path_(path) {}

    template <class T>
    std::vector<T> take(const char* name, ArrayType type, uint32_t columns = 1) const {
        const NamedArray& array = requireArray(arrays_, path_, name, type, columns);
        std::vector<T> values(array.bytes.size() / sizeof(T));
        if (!values.empty())
            std::memcpy(static_cast<void*>(values.data()), array.bytes.data(), array.bytes.size());
        return values;
    }
    /// The same of floats, which must be finite.
    template <class T> std::vector<T> takeFloats(const char* name, uint32_t columns) const {
        std::vector<T> values = take<T>(name, ArrayType::kFloat, columns);
        const auto* const floats = reinterpret_cast<const float*>(values.data());
        for (size_t i = 0; i < values.size() * columns; ++i)
            if (!(std::fabs(floats[i]) < 1e18f))
                refuse(name, i / columns, "is not finite, or beyond 1e18");
        return values;
    }
    void requireRows(const char* name, size_t is, size_t should) const {
        if (is != should)
            throw arrayError(path_, std::string("array \"") + name + "\" has " +
                                        std::to_string(is) + " rows; it needs " +
                                        std::to_string(should));
    }
    /// @param limit beyond every index
    void requireBelow(const char* name, const std::vector<uint32_t>& indices, size_t limit,
                      uint32_t allowed = 0) const {
        for (size_t i = 0; i < indices.size(); ++i)
            if (indices[i] >= limit && (allowed == 0 || indices[i] != allowed))
                refuse(name, i,
                       "is " + std::to_string(indices[i]) + ", beyond the " +
                           std::to_string(limit) + " there are");
    }
    [[noreturn]] void refuse(const char* name, size_t row, const std::string& what) const {
        throw arrayError(path_, std::string("array \"") + name + "\", row " + std::to_string(row) +
                                    ": " + what);
    }

private:
    const std::vector<NamedArray>& arrays_;
    const std::string& path_;
};

static_assert(sizeof(MaskInfo) == 5 * sizeof(uint32_t));

/// Returns the arrays that make a set.
std::vector<NamedArray> contentOf(const RaySet& set) {
    std::vector<uint32_t> cutMask;
    std::vector<float> cutUv;
    for (const CutTriangle& cut : set.masks.cuts) {
        cutMask.push_back(cut.mask);
        for (const glm::vec2& uv : cut.uv)
            cutUv.insert(cutUv.end(), {uv.x, uv.y});
    }
    return {arrayOf("position", ArrayType::kFloat, set.positionWorld, 3),
            arrayOf("normal", ArrayType::kFloat, set.normalWorld, 3),
            arrayOf("receiver", ArrayType::kUint32, set.receiver),
            arrayOf("pixel", ArrayType::kUint32, set.pixel),
            arrayOf("light_point", ArrayType::kFloat, set.lightPoint, 4),
            arrayOf("pair_sample", ArrayType::kUint32, set.pairSample),
            arrayOf("pair_light", ArrayType::kUint32, set.pairLight),
            arrayOf("vertex", ArrayType::kFloat, set.vertex, 3),
            arrayOf("triangle", ArrayType::kUint32, set.triangle, 3),
            arrayOf("triangle_cut", ArrayType::kUint32, set.masks.triangleCut),
            arrayOf("cut_mask", ArrayType::kUint32, cutMask),
            makeArray("cut_uv", ArrayType::kFloat, cutUv.data(), set.masks.cuts.size(), 6),
            arrayOf("mask", ArrayType::kUint32, set.masks.masks, 5),
            arrayOf("mask_words", ArrayType::kUint32, set.masks.words)};
}

AlphaMaskSet masksOf(const SetReader& reader, size_t triangleCount) {
    AlphaMaskSet masks;
    masks.triangleCut = reader.take<uint32_t>("triangle_cut", ArrayType::kUint32);
    const auto cutMask = reader.take<uint32_t>("cut_mask", ArrayType::kUint32);
    const auto uv = reader.takeFloats<std::array<float, 6>>("cut_uv", 6);
    masks.masks = reader.take<MaskInfo>("mask", ArrayType::kUint32, 5);
    masks.words = reader.take<uint32_t>("mask_words", ArrayType::kUint32);
    reader.requireRows("triangle_cut", masks.triangleCut.size(),
                       masks.triangleCut.empty() ? 0 : triangleCount);
    reader.requireRows("cut_uv", uv.size(), cutMask.size());
    reader.requireBelow("triangle_cut", masks.triangleCut, cutMask.size(), kNotCut);
    reader.requireBelow("cut_mask", cutMask, masks.masks.size());
    for (size_t m = 0; m < masks.masks.size(); ++m) {
        const MaskInfo& info = masks.masks[m];
        if (info.width < 1 || info.height < 1 || info.width > kMaxMaskSide ||
            info.height > kMaxMaskSide || info.wrapU > MaskWrap::kClamp ||
            info.wrapV > MaskWrap::kClamp ||
            uint64_t(info.firstWord) + uint64_t(maskRowWords(info.width)) * info.height >
                masks.words.size())
            reader.refuse("mask", m, "is no mask, or its bits lie beyond \"mask_words\"");
    }
    for (size_t c = 0; c < cutMask.size(); ++c)
        masks.cuts.push_back(
            {cutMask[c], {{uv[c][0], uv[c][1]}, {uv[c][2], uv[c][3]}, {uv[c][4], uv[c][5]}}});
    return masks;
}

} // namespace

Light RaySet::lightOf(size_t pair) const {
    const glm::vec4 point = lightPoint[pairLight[pair]];
    Light light;
    light.positionWorld = glm::vec3(point);
    light.rangeWorld = 1e18f;
    if (point.w == 0.0f) {
        light.kind = Light::kSun;
        light.directionWorld = -glm::vec3(point); // the distance is in it
        light.directionalDistanceWorld = 1.0f;
    }
    return light;
}

std::string raySetId(const std::vector<NamedArray>& arrays) {
    ContentHasher hasher;
    for (const char* name : kHashedArrays)
        if (const NamedArray* array = findArray(arrays, name)) {
            hasher.add(name, std::string_view(name).size() + 1);
            hasher.add(&array->rows, sizeof array->rows);
            hasher.add(array->bytes.data(), array->bytes.size());
        }
    return hashText(hasher.hash());
}

std::string RaySet::id() const {
    return raySetId(contentOf(*this));
}

RaySet makeRaySet(const GBufferView& gbuffer, const PairList& pairs, const World& world) {
    RaySet set;
    std::vector<uint32_t> indexOf(gbuffer.count());
    for (uint32_t s = 0; s < gbuffer.count(); ++s) {
        if (pairs.sampleStart[s] == pairs.sampleStart[s + 1])
            continue;
        indexOf[s] = uint32_t(set.pixel.size());
        set.positionWorld.push_back(gbuffer.positionWorld[s]);
        set.normalWorld.push_back(gbuffer.normalWorld[s]);
        set.receiver.push_back(gbuffer.triangle[s]);
        set.pixel.push_back(s);
    }
    for (const Light& light : world.lights())
        set.lightPoint.push_back(
            light.kind == Light::kSun
                ? glm::vec4(light.directionWorld * -light.directionalDistanceWorld, 0.0f)
                : glm::vec4(light.positionWorld, 1.0f));
    struct Pair {
        uint32_t light, sample;
    };
    std::vector<Pair> ofTile;
    for (uint32_t y0 = 0; y0 < gbuffer.height; y0 += kTile)
        for (uint32_t x0 = 0; x0 < gbuffer.width; x0 += kTile) {
            ofTile.clear();
            for (uint32_t y = y0; y < std::min(y0 + kTile, gbuffer.height); ++y)
                for (uint32_t x = x0; x < std::min(x0 + kTile, gbuffer.width); ++x) {
                    const uint32_t s = y * gbuffer.width + x;
                    for (uint64_t p = pairs.sampleStart[s]; p < pairs.sampleStart[s + 1]; ++p)
                        ofTile.push_back({pairs.light[p], indexOf[s]});
                }
            std::stable_sort(ofTile.begin(), ofTile.end(),
                             [](const Pair& a, const Pair& b) { return a.light < b.light; });
            for (const Pair& pair : ofTile) {
                set.pairSample.push_back(pair.sample);
                set.pairLight.push_back(pair.light);
            }
        }
    const TriangleView triangles = world.triangles();
    set.vertex.assign(triangles.positions.begin(), triangles.positions.end());
    set.triangle.assign(triangles.triangles.begin(), triangles.triangles.end());
    set.masks = AlphaMaskSet(triangles.masks);
    return set;
}

std::vector<NamedArray> arraysOf(const RaySet& set) {
    std::vector<NamedArray> arrays = contentOf(set);
    const std::string about = jsonLine(set.about), id = raySetId(arrays);
    arrays.insert(arrays.begin(),
                  {makeArray("about", ArrayType::kUint8, about.data(), about.size()),
                   makeArray("set_id", ArrayType::kUint8, id.data(), id.size())});
    return arrays;
}

RaySet raySetOf(const std::vector<NamedArray>& arrays, const std::string& path) {
    const SetReader reader(arrays, path);
    RaySet set;
    set.positionWorld = reader.takeFloats<glm::vec3>("position", 3);
    set.normalWorld = reader.takeFloats<glm::vec3>("normal", 3);
    set.receiver = reader.take<uint32_t>("receiver", ArrayType::kUint32);
    set.pixel = reader.take<uint32_t>("pixel", ArrayType::kUint32);
    set.lightPoint = reader.takeFloats<glm::vec4>("light_point", 4);
    set.pairSample = reader.take<uint32_t>("pair_sample", ArrayType::kUint32);
    set.pairLight = reader.take<uint32_t>("pair_light", ArrayType::kUint32);
    set.vertex = reader.takeFloats<glm::vec3>("vertex", 3);
    set.triangle = reader.take<glm::uvec3>("triangle", ArrayType::kUint32, 3);
    const size_t samples = set.positionWorld.size();
    reader.requireRows("normal", set.normalWorld.size(), samples);
    reader.requireRows("receiver", set.receiver.size(), samples);
    reader.requireRows("pixel", set.pixel.size(), samples);
    reader.requireRows("pair_light", set.pairLight.size(), set.pairSample.size());
    reader.requireBelow("receiver", set.receiver, set.triangle.size());
    reader.requireBelow("pair_sample", set.pairSample, samples);
    reader.requireBelow("pair_light", set.pairLight, set.lightPoint.size());
    for (size_t s = 0; s < samples; ++s)
        if (const float square = glm::dot(set.normalWorld[s], set.normalWorld[s]);
            !(std::fabs(square - 1.0f) < 1e-3f))
            reader.refuse("normal", s, "has not the length 1");
    for (size_t l = 0; l < set.lightPoint.size(); ++l)
        if (set.lightPoint[l].w != 0.0f && set.lightPoint[l].w != 1.0f)
            reader.refuse("light_point", l, "its fourth column is neither 0 nor 1");
    for (size_t t = 0; t < set.triangle.size(); ++t)
        for (int corner = 0; corner < 3; ++corner)
            if (set.triangle[t][corner] >= set.vertex.size())
                reader.refuse("triangle", t, "names a vertex that does not exist");
    set.masks = masksOf(reader, set.triangle.size());
    const NamedArray& id = requireArray(arrays, path, "set_id", ArrayType::kUint8, 1);
    if (std::string(id.bytes.begin(), id.bytes.end()) != raySetId(arrays))
        throw Error(ErrorKind::kInput, path + ": array \"set_id\" is not that of the other "
                                              "arrays; write the set again");
    const NamedArray& about = requireArray(arrays, path, "about", ArrayType::kUint8, 1);
    set.about = parseOwnJson(std::string(about.bytes.begin(), about.bytes.end()));
    if (!set.about.is_object())
        throw arrayError(path, "array \"about\" is no JSON object, or one whose values nest "
                               "deeper than " +
                                   std::to_string(kMaxJsonDepth));
    const auto refuseUnless = [&](const char* key, bool (Json::*isRight)() const noexcept,
                                  const char* what) {
        if (set.about.contains(key) && !(set.about[key].*isRight)())
            throw arrayError(path, std::string("array \"about\", key ") + key + ": is no " + what);
    };
    refuseUnless("scene", &Json::is_string, "text");
    refuseUnless("frame", &Json::is_number_integer, "whole number");
    refuseUnless("experiment", &Json::is_object, "object");
    return set;
}

void writeRaySet(const RaySet& set, const std::string& path) {
    const std::vector<NamedArray> arrays = arraysOf(set);
    OutputFile file(path);
    file.write(path.ends_with(".npz") ? encodeNpz(arrays) : encodeArrays(kRaySetKind, arrays));
    file.commit();
}

RaySet readRaySet(const std::string& path) {
    return raySetOf(readArrays(kRaySetKind, path), path);
}

} // namespace shadowdag
