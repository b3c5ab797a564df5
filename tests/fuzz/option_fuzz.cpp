// SPDX-License-Identifier: Apache-2.0
// The values of options: sizes, frames, thresholds, lists, shares, bytes. The first byte of an
// input chooses the kind.
#include "tests/fuzz/fuzz_target.h"
#include "tools/settings/parse.h"

namespace shadowdag::fuzz::option {

namespace {

void fuzzOne(const uint8_t* data, size_t size) {
    if (size == 0)
        return;
    const std::string text(data + 1, data + size);
    switch (data[0]) {
    case 's': {
        const auto [width, height] = parseSize("--size", text);
        fuzzCheck(uint64_t(width) * height <= kMaxPixelCount, "a picture has few pixels");
        break;
    }
    case 'f': {
        const std::vector<uint32_t> frames = parseFrames("--frames", text);
        fuzzCheck(!frames.empty() && frames.back() <= 1000000, "frames end at a million");
        break;
    }
    case 't':
        fuzzCheck(!parseThresholds("--thresholds", text).empty(), "there is a threshold");
        break;
    case 'k': {
        const auto [part, count] = parseShare("--part", text, 65536);
        fuzzCheck(part >= 1 && part <= count && count <= 65536, "a share is a part of all");
        break;
    }
    case 'm':
        fuzzCheck(parseMemoryLimit(text) >= 16u << 20, "a limit leaves room for the program");
        break;
    case 'p':
        fuzzCheck(parsePowerOfTwo("--resolution", text, 16, 131072) <= 17, "a resolution is small");
        break;
    case 'i':
        parseInteger("--lights", text, -1, 1000000);
        break;
    default:
        parseNumber("--exposure", text, 0, 1e9);
    }
}

std::vector<std::string> seeds() {
    return {"s640x360", "f0:90:30,7", "t0,8,16,96,inf", "k2/8", "m256M",
            "p4096",    "i100",       "n1.5e3",         "f3",   "m1.5G"};
}

[[maybe_unused]] const bool isAdded = addFuzzTarget(
    {.name = "option",
     .maxBytes = 1024,
     .fuzzOne = fuzzOne,
     .seeds = seeds,
     .words = {",", ":", "/", "x", "inf", "nan", "K", "M", "G", "0:1000000", "1000000", "(", ")"}});

} // namespace

} // namespace shadowdag::fuzz::option
