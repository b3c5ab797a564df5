// SPDX-License-Identifier: Apache-2.0
// Shafts and proofs of light: every single ray confirms what they prove.
#include "voxel/lit_proof.h"

#include "tests/voxel/voxel_sets.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace shadowdag {
namespace {

/// Samples as a cluster holds them.
struct Samples {
    std::vector<glm::vec3> position, normal;
    std::vector<uint32_t> x, y;

    void add(const glm::vec3& p, const glm::vec3& n, uint32_t px, uint32_t py) {
        position.push_back(p);
        normal.push_back(n);
        x.push_back(px);
        y.push_back(py);
    }
    size_t count() const { return position.size(); }
};

float unitOf(std::mt19937& random) {
    return std::uniform_real_distribution<float>(0, 1)(random);
}

glm::vec3 pointIn(float low, float high, std::mt19937& random) {
    return {low + (high - low) * unitOf(random), low + (high - low) * unitOf(random),
            low + (high - low) * unitOf(random)};
}

glm::vec3 direction(std::mt19937& random) {
    glm::vec3 d(0.0f);
    if (random() % 3 == 0)
        d[random() % 3] = random() % 2 ? 1.0f : -1.0f;
    else
        d = pointIn(-1, 1, random) + glm::vec3(1e-3f);
    return glm::normalize(d);
}

/// A patch of n x n pixels of a surface that may be bent or rough.
Samples patch(float size, uint32_t n, std::mt19937& random) {
    const glm::vec3 normal = direction(random), center = pointIn(0.1f * size, 0.9f * size, random);
    const glm::vec3 a = glm::normalize(glm::cross(normal, glm::vec3(0.31f, 0.52f, 0.79f)));
    const glm::vec3 b = glm::cross(normal, a);
    const float step = 0.02f * size * unitOf(random), bend = random() % 2 ? 0.0f : unitOf(random);
    const float rough = random() % 3 ? 0.0f : unitOf(random);
    Samples samples;
    for (uint32_t y = 0; y < n; ++y)
        for (uint32_t x = 0; x < n; ++x) {
            const float u = float(x) - 0.5f * float(n), v = float(y) - 0.5f * float(n);
            const glm::vec3 tilted = glm::normalize(normal + a * (bend * u / float(n)) +
                                                    rough * 0.2f * pointIn(-1, 1, random));
            samples.add(center + step * (a * u + b * v) -
                            normal * (0.5f * bend * step * u * u / float(n)),
                        tilted, x, y);
        }
    return samples;
}

/// A light anywhere: near, far, in the grid's planes, close to the patch's plane, behind it.
glm::vec3 lightFor(const Samples& samples, float size, std::mt19937& random) {
    const size_t i = random() % samples.count();
    switch (random() % 8) {
    case 0:
        return samples.position[i] + 3.0f * pointIn(-1, 1, random);
    case 1: // about in the receiver's plane
        return samples.position[i] + size * glm::cross(samples.normal[i], direction(random)) +
               samples.normal[i] * (3.0f * unitOf(random));
    case 2:
        return glm::round(pointIn(0, size, random));
    case 3:
        return pointIn(-20 * size, 20 * size, random);
    default:
        return pointIn(-0.2f * size, 1.2f * size, random);
    }
}

/// An axis-aligned base around all samples.
ShaftBase baseAround(const ShadowStarts& starts, AbovePlane& above) {
    glm::dvec3 low(1e300), high(-1e300), sum(0.0);
    for (size_t i = 0; i < starts.count(); ++i) {
        low = glm::min(low, starts.liftedStart(i));
        high = glm::max(high, starts.liftedStart(i));
        sum += starts.normal(i);
    }
    ShaftBase base;
    base.normal = glm::length(sum) > 1e-9 ? glm::normalize(sum) : glm::dvec3(0, 0, 1);
    for (size_t i = 0; i < starts.count(); ++i)
        base.normalSpread =
            std::max(base.normalSpread, glm::length(starts.normal(i) - base.normal) + 1e-9);
    for (int c = 0; c < 8; ++c)
        base.corner[c] = {(c & 1) ? high.x : low.x, (c & 2) ? high.y : low.y,
                          (c & 4) ? high.z : low.z};
    for (int a = 0; a < 3; ++a) {
        base.side[a] = glm::dvec3(0.0);
        base.side[a][a] = 1;
    }
    above.make(glm::vec3(base.normal));
    base.above = &above;
    return base;
}

std::vector<uint32_t> allOf(size_t count) {
    std::vector<uint32_t> all(count);
    for (uint32_t i = 0; i < count; ++i)
        all[i] = i;
    return all;
}

/// Returns whether a shaft over all samples proves them lit; checks it against every ray.
bool isProvenLit(const TwoForms& forms, const Samples& samples, const glm::vec3& light) {
    ShadowStarts starts;
    starts.reset(forms.dag.grid, 1.0f);
    for (size_t i = 0; i < samples.count(); ++i)
        starts.add(samples.position[i], samples.normal[i]);
    std::vector<DagSegment> segments(samples.count());
    const std::vector<uint32_t> all = allOf(samples.count());
    starts.segments(light, viewOf(all), segments.data());
    AbovePlane above;
    Shaft shaft;
    if (!shaft.make(starts, baseAround(starts, above), viewOf(all), light) ||
        forms.wide.words.empty() || !shaft.isEmpty(forms.wide.view()))
        return false;
    for (const DagSegment& segment : segments)
        EXPECT_FALSE(occluded(forms.view(), segment));
    return true;
}

TEST(ShadowStarts, GiveTheSegmentsOfShadowSegmentBitForBit) {
    std::mt19937 random(3);
    for (int round = 0; round < 300; ++round) {
        VoxelGrid grid;
        grid.resolutionLog2 = 4 + random() % 10;
        grid.voxelSizeWorld = round % 3 ? 0.013 * (1 + random() % 100) : 1.0;
        grid.originWorld = round % 3 ? glm::dvec3(pointIn(-100, 100, random)) : glm::dvec3(0.0);
        const float offset = float(random() % 4) * 0.5f;
        const float size = float(double(grid.resolution()) * grid.voxelSizeWorld);
        Samples samples = patch(size, 1 + random() % 5, random);
        for (glm::vec3& p : samples.position)
            p += glm::vec3(grid.originWorld);
        glm::vec3 light = lightFor(samples, size, random);
        if (round % 5 == 0)
            light = samples.position[0];
        ShadowStarts starts;
        starts.reset(grid, offset);
        for (size_t i = 0; i < samples.count(); ++i)
            starts.add(samples.position[i], samples.normal[i]);
        const std::vector<uint32_t> all = allOf(samples.count());
        std::vector<DagSegment> segments(all.size());
        starts.segments(light, viewOf(all), segments.data());
        for (size_t i = 0; i < all.size(); ++i) {
            const DagSegment one =
                shadowSegment(grid, samples.position[i], samples.normal[i], light, offset, 0);
            ASSERT_EQ(std::memcmp(&one, &segments[i], sizeof one), 0)
                << "round " << round << " sample " << i;
        }
    }
}

TEST(Shaft, ProvesNoBlockedRayLit) {
    constexpr uint32_t kSeed = 17;
    std::mt19937 random(kSeed);
    size_t litCount = 0, openCount = 0;
    for (int round = 0; round < 60; ++round) {
        const uint32_t log2 = 4 + round % 4;
        DenseGrid grid = randomGrid(log2, round % 2 ? 0.0005 : 0.00002, random);
        for (int walls = random() % 4; walls > 0; --walls) { // slanted, of several thicknesses
            const glm::vec3 n = direction(random), at = pointIn(0, float(grid.size()), random);
            const float thickness = 0.6f + 2 * unitOf(random);
            for (uint32_t z = 0; z < grid.size(); ++z)
                for (uint32_t y = 0; y < grid.size(); ++y)
                    for (uint32_t x = 0; x < grid.size(); ++x)
                        if (std::fabs(glm::dot(n, glm::vec3(x, y, z) - at)) < thickness)
                            grid.set(x, y, z);
        }
        const TwoForms forms(dagOf(grid));
        for (int i = 0; i < 60; ++i) {
            const Samples samples = patch(float(grid.size()), 1 + random() % 8, random);
            const glm::vec3 light = lightFor(samples, float(grid.size()), random);
            ++(isProvenLit(forms, samples, light) ? litCount : openCount);
            if (HasFailure())
                FAIL() << "seed " << kSeed << " round " << round << " patch " << i;
        }
    }
    EXPECT_GT(litCount, 100u);
    EXPECT_GT(openCount, 100u);
}

/// A hall of 128 voxels with a floor at y = 0 and, optionally, a wall at x = 64.
DenseGrid hall(bool hasWall, bool hasHole) {
    DenseGrid grid(7);
    for (uint32_t b = 0; b < grid.size(); ++b)
        for (uint32_t a = 0; a < grid.size(); ++a) {
            grid.set(a, 0, b);
            if (hasWall && !(hasHole && a == 20 && b == 62))
                grid.set(64, a, b);
        }
    return grid;
}

Samples floorPatch() {
    Samples samples;
    for (uint32_t y = 0; y < 16; ++y)
        for (uint32_t x = 0; x < 16; ++x)
            samples.add({20 + float(x), 0.5f, 56 + float(y)}, {0, 1, 0}, x, y);
    return samples;
}

TEST(Shaft, AHallIsProvenLitUnlessAWallCrossesIt) {
    const glm::vec3 light(110, 50, 64);
    EXPECT_TRUE(isProvenLit(TwoForms(dagOf(hall(false, false))), floorPatch(), light));
    EXPECT_FALSE(isProvenLit(TwoForms(dagOf(hall(true, false))), floorPatch(), light));
    EXPECT_FALSE(isProvenLit(TwoForms(dagOf(hall(true, true))), floorPatch(), light));
    // The wall is past the light, or behind the receivers: it does not matter.
    EXPECT_TRUE(isProvenLit(TwoForms(dagOf(hall(true, false))), floorPatch(), {60, 50, 64}));
}

TEST(Shaft, RefusesUnsupportedLights) {
    const TwoForms forms(dagOf(hall(false, false)));
    const Samples samples = floorPatch();
    ShadowStarts starts;
    starts.reset(forms.dag.grid, 1.0f);
    for (size_t i = 0; i < samples.count(); ++i)
        starts.add(samples.position[i], samples.normal[i]);
    AbovePlane above;
    const ShaftBase base = baseAround(starts, above);
    const std::vector<uint32_t> all = allOf(samples.count());
    Shaft shaft;
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN(),
                    kInfinity = std::numeric_limits<float>::infinity();
    for (const glm::vec3& light :
         {glm::vec3(28, 1.5f, 64), glm::vec3(100, 0.6f, 64), glm::vec3(100, -5, 64),
          glm::vec3(kNan, 50, 64), glm::vec3(50, kNan, 64), glm::vec3(50, 50, kNan),
          glm::vec3(50, kInfinity, 64), glm::vec3(50, 2e6f, 64)})
        EXPECT_FALSE(shaft.make(starts, base, viewOf(all), light)) << light.x << " " << light.y;
    EXPECT_TRUE(shaft.make(starts, base, viewOf(all), {28, 4, 64}));
    EXPECT_TRUE(shaft.make(starts, base, viewOf(all), {-900, 4000, 64})); // outside the grid
}

/// Samples in the order of a cluster, and which of them are selected.
struct Cluster {
    ReceiverGroups receivers;
    std::vector<uint8_t> isAsked;

    Cluster(const VoxelGrid& grid, const Samples& samples, uint32_t everyOther = 1) {
        receivers.reset(grid, 1.0f);
        for (size_t i = 0; i < samples.count(); ++i) {
            receivers.add(samples.position[i], samples.normal[i], samples.x[i], samples.y[i]);
            isAsked.push_back(i % everyOther == 0);
        }
        receivers.build();
    }
};

/// Returns whether the selected samples are proven lit; compares with single rays.
bool provesLit(const TwoForms& forms, const Samples& samples, const glm::vec3& light,
               uint32_t everyOther = 1) {
    const Cluster cluster(forms.dag.grid, samples, everyOther);
    LitProof proof;
    proof.reset(cluster.receivers);
    if (!proof.provesLit(forms.view(), light, viewOf(cluster.isAsked)))
        return false;
    for (size_t i = 0; i < samples.count(); ++i)
        EXPECT_FALSE(cluster.isAsked[i] &&
                     occluded(forms.view(), shadowSegment(forms.dag.grid, samples.position[i],
                                                          samples.normal[i], light, 1.0f, 0)));
    return true;
}

TEST(LitProof, ProvesNoBlockedRayLit) {
    constexpr uint32_t kSeed = 5;
    std::mt19937 random(kSeed);
    size_t litCount = 0, openCount = 0;
    for (int round = 0; round < 30; ++round) {
        DenseGrid grid = randomGrid(7, 0.00002, random);
        for (uint32_t b = 0; b < grid.size(); ++b)
            for (uint32_t a = 0; a < grid.size(); ++a) {
                grid.set(a, b, 40);
                if (a > 64)
                    grid.set(70, b, a);
            }
        const TwoForms forms(dagOf(grid));
        for (int i = 0; i < 20; ++i) {
            Samples samples = patch(float(grid.size()), 32, random);
            if (i % 2) { // a second surface in the same tile
                const Samples other = patch(float(grid.size()), 32, random);
                for (size_t k = 0; k < samples.count(); k += 1 + random() % 3) {
                    samples.position[k] = other.position[k];
                    samples.normal[k] = other.normal[k];
                }
            }
            const glm::vec3 light = lightFor(samples, float(grid.size()), random);
            ++(provesLit(forms, samples, light, 1 + random() % 3) ? litCount : openCount);
            if (HasFailure())
                FAIL() << "seed " << kSeed << " round " << round << " cluster " << i;
        }
    }
    EXPECT_GT(litCount, 5u);
    EXPECT_GT(openCount, 5u);
}

TEST(LitProof, HoldsAtTheLimits) {
    const TwoForms open(dagOf(hall(false, false))), walled(dagOf(hall(true, true)));
    const Samples patch = floorPatch();
    EXPECT_TRUE(provesLit(open, patch, {110, 50, 64}));
    EXPECT_FALSE(provesLit(walled, patch, {110, 50, 64}));
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
    for (const glm::vec3& light :
         {glm::vec3(28, 1.5f, 64), patch.position[40], glm::vec3(100, 0.5f, 64),
          glm::vec3(100, 0.6f, 64), glm::vec3(28, -20, 64), glm::vec3(-900, 4000, 64),
          glm::vec3(5e6f, 5e6f, 0), glm::vec3(kNan, 50, 64)})
        provesLit(walled, patch, light);

    Samples one; // fewer than a shaft is made for: its ray
    one.add({20, 0.5f, 60}, {0, 1, 0}, 31, 31);
    EXPECT_TRUE(provesLit(open, one, {110, 50, 64}));

    DenseGrid tiny(2);
    tiny.set(1, 2, 3);
    provesLit(TwoForms(dagOf(tiny)), patch, {110, 50, 64});
}

TEST(ReceiverGroups, ListEverySampleOnceByFacetAndPart) {
    constexpr uint32_t kSeed = 11;
    std::mt19937 random(kSeed);
    for (int round = 0; round < 20; ++round) {
        SCOPED_TRACE("seed " + std::to_string(kSeed) + " round " + std::to_string(round));
        const Samples samples = patch(128.0f, 1 + random() % 32, random);
        const Cluster cluster(VoxelGrid{}, samples, 1 + random() % 3);
        const ReceiverGroups& receivers = cluster.receivers;
        std::vector<uint32_t> sorted = receivers.order();
        EXPECT_TRUE(std::is_sorted(sorted.begin(), sorted.end(), [&](uint32_t a, uint32_t b) {
            return receivers.binOf(a) != receivers.binOf(b)
                       ? receivers.binOf(a) < receivers.binOf(b)
                       : a < b;
        }));
        std::vector<uint32_t> asked, wanted;
        std::vector<uint32_t> binStart(receivers.binCount() + 1);
        receivers.listAsked(viewOf(cluster.isAsked), asked, binStart.data());
        for (const uint32_t i : sorted)
            if (cluster.isAsked[i])
                wanted.push_back(i);
        EXPECT_EQ(asked, wanted);
        EXPECT_EQ(binStart.back(), asked.size());
        for (uint32_t bin = 0; bin < receivers.binCount(); ++bin)
            for (uint32_t k = binStart[bin]; k < binStart[bin + 1]; ++k)
                EXPECT_EQ(receivers.binOf(asked[k]), bin);
        std::sort(sorted.begin(), sorted.end());
        EXPECT_EQ(sorted, allOf(samples.count()));
    }
}

TEST(AbovePlane, LeavesOutNoCellThatMayBeAbove) {
    std::mt19937 random(9);
    for (int round = 0; round < 500; ++round) {
        const glm::vec3 n = direction(random);
        AbovePlane above;
        above.make(n);
        const float height = -5 + 10 * unitOf(random);
        const uint64_t cells = above.cells(height);
        uint64_t sure = 0;
        for (uint32_t i = 0; i < 64; ++i) {
            const glm::vec3 place((i >> 3 & 1) * 2 + (i & 1), (i >> 4 & 1) * 2 + (i >> 1 & 1),
                                  (i >> 5 & 1) * 2 + (i >> 2 & 1));
            sure |= uint64_t(glm::dot(n, place) >= height) << i;
            if (glm::dot(n, place) < height - 0.3f) { // buckets are a sixth of a cell at most
                EXPECT_EQ(cells >> i & 1, 0u);
            }
        }
        EXPECT_EQ(cells & sure, sure);
    }
}

} // namespace
} // namespace shadowdag
