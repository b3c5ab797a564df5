// SPDX-License-Identifier: Apache-2.0
// Ray sets, as .rays and as .npz, with checksums that fit.
#include "cuda/error.h"
#include "tests/fuzz/array_seeds.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/tools/workspace/ray_set_files.h"

namespace shadowdag::fuzz::rays {

namespace {

void fuzzOne(const uint8_t* data, size_t size) {
    const RaySet set = raySetOf(readBytes(kRaySetKind, data, size), "set");
    for (size_t p = 0; p < set.pairCount(); ++p)
        set.pairEnd(p);
    for (size_t t = 0; t < set.triangle.size(); ++t)
        for (int corner = 0; corner < 3; ++corner)
            set.triangles().vertex(t, corner);
    for (size_t t = 0; t < set.triangle.size(); ++t)
        if (set.masks.view().isCut(t))
            set.masks.view().isOpaque(t, 1.0, 0.5, 0.25);
    fuzzCheck(raySetOf(arraysOf(set), "again").id() == set.id(), "a set is read as it was written");
}

std::vector<std::string> seeds() {
    const std::vector<NamedArray> arrays = arraysOf(makeSmallRaySet());
    return {encodeArrays(kRaySetKind, arrays), encodeNpz(arrays)};
}

/// Makes checksums and the set's id fit.
std::string pack(const std::string& content) {
    const std::string file = withFittingSums(content);
    try {
        std::vector<NamedArray> arrays = decodeArrays(kRaySetKind, file, "set");
        const std::string id = raySetId(arrays);
        for (NamedArray& array : arrays)
            if (array.name == "set_id")
                array = makeArray("set_id", ArrayType::kUint8, id.data(), id.size());
        return encodeArrays(kRaySetKind, arrays);
    } catch (const Error&) {
        return file;
    }
}

[[maybe_unused]] const bool isAdded = addFuzzTarget(
    {.name = "rays", .maxBytes = 16384, .fuzzOne = fuzzOne, .seeds = seeds, .pack = pack});

} // namespace

} // namespace shadowdag::fuzz::rays
