// SPDX-License-Identifier: Apache-2.0
#include "hybrid/rays/beam_rays.h"

#include "hybrid/rays/beam_stream.h"
#include "hybrid/rays/exact_stream.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace shadowdag {

namespace {

constexpr float kRounding = float(kHalfUlp);
/// Least side of a cell that is not divided, in pixels; at most twice as much.
constexpr double kCellPixels = 6.0;
/// Times that a cell may be divided in two along each axis.
constexpr int kMaxDepth = 2;
constexpr uint32_t kTableSize = 2048; ///< a cluster has up to 1024 samples
constexpr uint32_t kNoGroup = ~0u;
constexpr uint32_t kPadding = 32; ///< lanes of the widest packet

} // namespace

BeamRays::BeamRays(const ExactView& exact, BeamCache& cache, StreamIsa isa)
    : exact_(exact), cache_(cache), isa_(isa) {}

BeamRays::Cells BeamRays::cellsOf(int exponent) const {
    return {glm::vec3(exact_.geometry.origin), std::ldexp(1.0f, -exponent),
            uint64_t(exponent & 127) << 54};
}

uint64_t BeamRays::Cells::keyOf(const glm::vec3& positionWorld, const glm::vec3& normal) const {
    // 3 bits of facet, 7 of size, 18 for each coordinate. Cells that share a key by wrapping around
    // share beams that hold for both.
    const glm::vec3 p = (positionWorld - originWorld) * inverseSize, m = glm::abs(normal);
    const int axis = m.x >= m.y ? (m.x >= m.z ? 0 : 2) : (m.y >= m.z ? 1 : 2);
    uint64_t key = uint64_t(2 * axis + (normal[axis] < 0.0f)) << 61 | sizeBits;
    for (int a = 0; a < 3; ++a)
        key |= (uint64_t(int64_t(std::floor(p[a]))) & 0x3ffff) << (18 * a);
    return key;
}

uint32_t BeamRays::groupOf(uint64_t key, float size) {
    for (uint32_t h = uint32_t((key * 0x9e3779b97f4a7c15ull) >> 53);; h = (h + 1) % kTableSize) {
        uint32_t& at = table_[h];
        if (at == kNoGroup) {
            at = uint32_t(groups_.size());
            usedSlots_.push_back(h);
            groups_.push_back({key, size, {}, 0, 0, nullptr});
            cache_.prefetchSlot(key);
            return at;
        }
        if (groups_[at].key == key)
            return at;
    }
}

void BeamRays::setCluster(View<const glm::vec3> positionWorld, View<const glm::vec3> normalWorld,
                          View<const uint32_t> samples, double footprintWorld,
                          std::vector<uint32_t>& sorted) {
    int exponent;
    std::frexp(kCellPixels * footprintWorld, &exponent);
    starts_ = {};
    groups_.clear();
    table_.resize(kTableSize, kNoGroup);
    for (const uint32_t slot : usedSlots_)
        table_[slot] = kNoGroup;
    usedSlots_.clear();
    groupOf_.assign(samples.count, kNoGroup);
    // Cells that are divided give their samples to those of half the size, and so on.
    size_t firstNew = 0;
    for (int depth = 0; depth <= kMaxDepth; ++depth, --exponent) {
        const Cells cells = cellsOf(exponent);
        const float size = std::ldexp(1.0f, exponent);
        uint64_t last = 0;
        uint32_t lastGroup = kNoGroup;
        for (size_t i = 0; i < samples.count; ++i) {
            if (groupOf_[i] != kNoGroup)
                continue;
            const uint64_t key = cells.keyOf(positionWorld[samples[i]], normalWorld[samples[i]]);
            if (lastGroup == kNoGroup || key != last)
                lastGroup = groupOf(key, size);
            last = key;
            groupOf_[i] = lastGroup;
            ++groups_[lastGroup].end;
        }
        for (size_t g = firstNew; g < groups_.size(); ++g)
            cache_.prefetchCell(groups_[g].key);
        bool anySplit = false;
        for (size_t g = firstNew; g < groups_.size(); ++g) {
            BeamCache::Cell* cell = cache_.peek(groups_[g].key);
            if (depth < kMaxDepth && groups_.size() < kTableSize / 4 && cell &&
                cache_.isSplit(*cell)) {
                groups_[g].end = 0;
                anySplit = true;
            }
        }
        if (!anySplit)
            break;
        for (uint32_t& group : groupOf_)
            if (groups_[group].end == 0)
                group = kNoGroup;
        firstNew = groups_.size();
    }
    uint32_t first = 0;
    for (Group& group : groups_) {
        const uint32_t count = group.end;
        group.begin = group.end = first;
        first += count;
    }
    sorted.resize(samples.count);
    for (size_t i = 0; i < samples.count; ++i)
        sorted[groups_[groupOf_[i]].end++] = samples[i];
    std::erase_if(groups_, [](const Group& group) { return group.begin == group.end; });
}

void BeamRays::setStarts(View<const TruthStart> starts) {
    starts_ = starts;
    const size_t padded = starts.count + kPadding;
    for (std::vector<float>& x : start_)
        x.resize(padded);
    for (std::vector<float>& x : plane_)
        x.resize(padded);
    clear_.resize(padded);
    receivers_.resize(padded);
    active_.assign(padded / 64 + 2, 0);
    open_.assign(padded / 64 + 2, 0);
    for (size_t i = 0; i < starts.count; ++i) {
        const ReceiverPlane& plane = starts[i].plane;
        for (int a = 0; a < 3; ++a) {
            start_[a][i] = starts[i].startLocal[a];
            plane_[a][i] = float(plane.normal[a]);
        }
        plane_[3][i] = float(plane.offset);
        // A light that is this high above the plane in floats is more than 3 c above it.
        clear_[i] = 4.0f * float(plane.clearance) + 8.0f * kRounding * std::fabs(plane_[3][i]);
        receivers_[i] = plane.triangle;
    }
    for (size_t i = starts.count; i < padded; ++i)
        for (int a = 0; a < 3; ++a)
            start_[a][i] = start_[a][0];
    // Rays start at least c above the receiver and end higher; c is twice this at least. A power of
    // two, as beams are kept while c changes a little.
    const double raised =
        std::exp2(std::floor(std::log2(0.5 * clearanceOf(0.0, exact_.geometry.diagonal))));
    for (Group& group : groups_) {
        BeamPlanes receivers;
        BeamPlane last{};
        for (uint32_t i = group.begin; i < group.end; ++i) {
            group.box.add(starts[i].startLocal);
            const BeamPlane plane{starts[i].plane.normal, starts[i].plane.offset + raised};
            if (i == group.begin || !(plane == last))
                receivers.add(plane);
            last = plane;
        }
        group.cell = cache_.cellOf(group.key, group.box, receivers, group.size);
    }
}

uint32_t BeamRays::answer(uint32_t lightIndex, const Light& light, const uint8_t* isAsked,
                          View<uint8_t> isDark) {
    const glm::dvec3 lightLocal = glm::dvec3(light.positionWorld) - exact_.geometry.origin;
    const glm::vec3 at(lightLocal);
    if (isFarLight(at, exact_.geometry.diagonal)) {
        for (size_t i = 0; i < starts_.count; ++i) {
            const uint64_t bit = uint64_t(isAsked[i]) << (i % 64);
            open_[i / 64] = i % 64 == 0 ? bit : open_[i / 64] | bit;
        }
        return countOpen();
    }
    // Rays whose light has to be raised above the receiver's plane, or that have no length, are
    // none of the beam's.
    stream::ActiveWork work{};
    for (int a = 0; a < 3; ++a)
        work.light[a] = at[a];
    for (int a = 0; a < 4; ++a)
        work.plane[a] = plane_[a].data();
    work.beyond = 8.0f * kRounding * (std::fabs(at.x) + std::fabs(at.y) + std::fabs(at.z));
    work.clear = clear_.data();
    work.isAsked = isAsked;
    work.count = starts_.count;
    work.active = active_.data();
    work.open = open_.data();
    stream::findActive(isa_, work);
    std::memset(isDark.data, 0, isDark.count);
    BeamTally tally;
    for (size_t g = 0; g < groups_.size(); ++g) {
        const Group& group = groups_[g];
        if (g + 1 < groups_.size() && groups_[g + 1].cell)
            cache_.prefetch(*groups_[g + 1].cell, lightIndex);
        uint32_t count = 0;
        forWords(group, [&](size_t word, uint64_t mask) {
            count += uint32_t(__builtin_popcountll(active_[word] & mask));
        });
        if (count == 0)
            continue;
        const Beam beam = cache_.find(group.cell, lightIndex, at, count, tally);
        if (beam.kind == BeamKind::kListed)
            traceListed(group, beam, lightLocal, isDark);
        else if (beam.kind == BeamKind::kDark)
            std::memset(isDark.data + group.begin, 1, group.end - group.begin);
        else if (beam.kind == BeamKind::kOpen)
            forWords(group,
                     [&](size_t word, uint64_t mask) { open_[word] |= active_[word] & mask; });
    }
    tally.openCount = countOpen();
    cache_.add(tally);
    return uint32_t(tally.openCount);
}

uint32_t BeamRays::countOpen() const {
    uint32_t open = 0;
    for (size_t word = 0; 64 * word < starts_.count; ++word)
        open += uint32_t(__builtin_popcountll(open_[word]));
    return open;
}

void BeamRays::listOpen(View<uint8_t> isOpen) const {
    for (size_t i = 0; i < isOpen.count; ++i)
        isOpen[i] = uint8_t(open_[i / 64] >> (i % 64) & 1);
}

/// The rays of a light, for the test in double.
struct BeamRays::Listed {
    const BeamRays& rays;
    uint32_t first;
    glm::dvec3 lightLocal;

    static bool confirm(void* user, uint32_t ray, uint32_t triangle) {
        const Listed& of = *static_cast<const Listed*>(user);
        const TruthStart& start = of.rays.starts_[of.first + ray];
        return blocksTruthRay(of.rays.exact_.geometry,
                              truthRay(start.plane, start.startLocal, of.lightLocal), triangle);
    }
};

void BeamRays::traceListed(const Group& group, const Beam& beam, const glm::dvec3& lightLocal,
                           View<uint8_t> isDark) {
    Listed user{*this, group.begin, lightLocal};
    const glm::vec3 origin(lightLocal);
    stream::ListedWork work{};
    for (int a = 0; a < 3; ++a) {
        work.rays.origin[a] = origin[a];
        work.start[a] = start_[a].data() + group.begin;
    }
    work.active = active_.data();
    work.firstBit = group.begin;
    work.rays.leaves = exact_.bvh.leaves.data;
    work.rays.receivers = receivers_.data() + group.begin;
    work.rays.count = group.end - group.begin;
    work.rays.confirm = Listed::confirm;
    work.rays.user = &user;
    work.isDark = isDark.data + group.begin;
    work.listCount = beam.count;
    work.leaf = beam.leaf;
    work.mask = beam.mask;
    stream::traceListed(isa_, work);
}

} // namespace shadowdag
