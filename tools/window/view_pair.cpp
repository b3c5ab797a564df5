// SPDX-License-Identifier: Apache-2.0
#include "tools/window/view_pair.h"

#include "hybrid/clusters/pairs.h"
#include "tools/window/view_observer.h"
#include "tools/workspace/error_image.h"

#include <algorithm>

namespace shadowdag {

namespace {

constexpr glm::vec3 kWhite(0.95f), kBlack(0.0f);

/// Cuts a line to a picture; returns whether something is left. By Liang and Barsky, A new concept
/// and method for line clipping, 1984.
bool cutToPicture(const ViewRays& view, PairLine& line) {
    const glm::dvec2 way = line.to - line.from;
    const glm::dvec2 low(-0.5), high(double(view.width) - 0.5, double(view.height) - 0.5);
    double begin = 0.0, end = 1.0;
    for (int axis = 0; axis < 2; ++axis) {
        if (way[axis] == 0.0) {
            if (line.from[axis] < low[axis] || line.from[axis] > high[axis])
                return false;
            continue;
        }
        const double a = (low[axis] - line.from[axis]) / way[axis];
        const double b = (high[axis] - line.from[axis]) / way[axis];
        begin = std::max(begin, std::min(a, b));
        end = std::min(end, std::max(a, b));
    }
    line = {line.part, line.from + begin * way, line.from + end * way};
    return begin <= end;
}

} // namespace

// Blue beside orange, sky blue and white is the one of Okabe and Ito's colours that stays farthest
// from them with each kind of colour blindness. It is dark, so it lies on white.
const std::array<PairPartStyle, 4> kPairParts{{{"triangle", kBlue, kWhite},
                                               {"voxel", kSkyBlue, kBlack},
                                               {"texel", kOrange, kBlack},
                                               {"ray", kWhite, kBlack}}};

std::vector<PairLine> pairLines(const ViewRays& view, const PairGeometry& pair) {
    std::vector<PairLine> lines;
    const auto add = [&](PairPart part, const glm::dvec3& a, const glm::dvec3& b) {
        const auto ends = pixelsOfSegment(view, a, b);
        if (!ends)
            return;
        PairLine line{part, glm::dvec2(ends->first), glm::dvec2(ends->second)};
        if (cutToPicture(view, line))
            lines.push_back(line);
    };
    const auto addOutline = [&](PairPart part, const auto& corners) {
        for (size_t i = 0; i < corners.size(); ++i)
            add(part, glm::dvec3(corners[i]), glm::dvec3(corners[(i + 1) % corners.size()]));
    };
    if (pair.triangleWorld)
        addOutline(PairPart::kTriangle, *pair.triangleWorld);
    if (pair.voxelWorld)
        for (const auto& [a, b] : edgesOf(*pair.voxelWorld))
            add(PairPart::kVoxel, a, b);
    if (pair.texelWorld)
        addOutline(PairPart::kTexel, *pair.texelWorld);
    add(PairPart::kRay, glm::dvec3(pair.sampleWorld), glm::dvec3(pair.lightWorld));
    return lines;
}

std::array<glm::vec3, 4> texelCorners(const ShadowMapInfo& map, const glm::vec3& pointWorld) {
    const glm::vec3 d(lightFromWorld(map, pointWorld));
    const uint32_t face = map.window.isDirectional() ? kDirectionalFace : faceOf(d);
    const glm::vec3 q = faceFromLight(face, d);
    const uint32_t x = faceCell(q.x / q.z, map.faceTexels), y = faceCell(q.y / q.z, map.faceTexels);
    const auto corner = [&](uint32_t column, uint32_t row) {
        const auto at = [&](uint32_t cell) {
            return 2.0f * float(cell) / float(map.faceTexels) - 1.0f;
        };
        return worldFromMap(map, face, at(column), at(row), 1.0f / q.z);
    };
    return {corner(x, y), corner(x + 1, y), corner(x + 1, y + 1), corner(x, y + 1)};
}

int drawnPair(const PixelReport& pixel, int light) {
    const auto isDark = [](const PixelPair& pair) {
        return std::any_of(pair.answers.begin(), pair.answers.end(), [](const PairResult& answer) {
            return answer.method == "truth" && answer.visibility >= 0 &&
                   answer.visibility < int(kHalfLit);
        });
    };
    const auto indexOf = [&](const auto& isIt) {
        const auto found = std::find_if(pixel.pairs.begin(), pixel.pairs.end(), isIt);
        return found == pixel.pairs.end() ? -1 : int(found - pixel.pairs.begin());
    };
    int index = indexOf([&](const PixelPair& pair) { return int(pair.light) == light; });
    if (index < 0)
        index = indexOf(isDark);
    return index < 0 && !pixel.pairs.empty() ? 0 : index;
}

} // namespace shadowdag
