// SPDX-License-Identifier: Apache-2.0
#include "scenes/open_space.h"

#include "cuda/cancel.h"
#include "scenes/surface_sampler.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace shadowdag {

namespace {

constexpr int kCandidateCount = 512;
constexpr int kFanCount = 26;

// Towards the faces, edges and corners of a cube.
std::array<glm::vec3, kFanCount> makeFan() {
    std::array<glm::vec3, kFanCount> fan;
    int n = 0;
    for (int z = -1; z <= 1; ++z)
        for (int y = -1; y <= 1; ++y)
            for (int x = -1; x <= 1; ++x)
                if (x != 0 || y != 0 || z != 0) {
                    const glm::vec3 d = glm::vec3(float(x), float(y), float(z));
                    fan[size_t(n++)] = d / std::sqrt(glm::dot(d, d));
                }
    return fan;
}

float quantile(std::vector<float> values, double share) {
    const size_t rank = std::min(size_t(share * double(values.size())), values.size() - 1);
    std::nth_element(values.begin(), values.begin() + std::ptrdiff_t(rank), values.end());
    return values[rank];
}

} // namespace

float spaceAlong(const TriangleTree& tree, const Box& bounds, const glm::vec3& point,
                 const glm::vec3& direction) {
    float room = std::numeric_limits<float>::infinity();
    for (int axis = 0; axis < 3; ++axis)
        if (direction[axis] != 0.0f) {
            const float end = direction[axis] > 0.0f ? bounds.max[axis] : bounds.min[axis];
            room = std::min(room, (end - point[axis]) / direction[axis]);
        }
    if (!(room > 0.0f))
        return 0.0f;
    return std::min(room, tree.trace(point, direction, room).distance);
}

// The triangles that the fan hits are appended to `triangles`, when asked for.
OpenSpace::Station OpenSpace::probe(const glm::vec3& position,
                                    std::vector<uint32_t>* triangles) const {
    static const std::array<glm::vec3, kFanCount> kFan = makeFan();
    std::array<float, kFanCount> lengths;
    int hitCount = 0, backCount = 0;
    for (int i = 0; i < kFanCount; ++i) {
        const glm::vec3& d = kFan[size_t(i)];
        const TriangleTree::Hit hit = tree_.trace(position, d);
        if (std::isfinite(hit.distance)) {
            ++hitCount;
            backCount += hit.isFrontFace ? 0 : 1;
            if (triangles != nullptr)
                triangles->push_back(hit.triangle);
        }
        float length = hit.distance;
        for (int axis = 0; axis < 3; ++axis)
            if (d[axis] != 0.0f) {
                const float end = d[axis] > 0.0f ? bounds_.max[axis] : bounds_.min[axis];
                length = std::min(length, (end - position[axis]) / d[axis]);
            }
        lengths[size_t(i)] = std::max(length, 0.0f);
    }
    std::sort(lengths.begin(), lengths.end());
    return {position, lengths[kFanCount / 2], lengths[0],
            hitCount > 0 ? float(backCount) / float(hitCount) : 0.0f,
            1.0f - float(hitCount) / float(kFanCount)};
}

// From a point in free space to one above the floor below it. Returns false where there is no
// floor; the point then stays.
bool OpenSpace::raiseToEyeHeight(glm::vec3& position, double share) const {
    const float down = tree_.trace(position, {0, -1, 0}).distance;
    if (!std::isfinite(down))
        return false;
    const float up = tree_.trace(position, {0, 1, 0}).distance;
    float height = down + up;
    if (!std::isfinite(up)) // the sky: as high as it is wide, but within the bounds
        height = std::min(probe(position).openness, down + bounds_.max.y - position.y);
    position.y += height * float(share) - down;
    return true;
}

OpenSpace::OpenSpace(TriangleView triangles, const Box& bounds, const std::vector<Light>& lights,
                     uint64_t seed)
    : bounds_(bounds), tree_(triangles, bounds) {
    PlacementRandom random(seed);
    const SurfaceSampler surface(triangles);
    const float diagonal = glm::length(bounds.extent());
    std::vector<Station> candidates;
    candidates.reserve(kCandidateCount);
    for (int i = 0; i < kCandidateCount; ++i) {
        pollCpu();
        const glm::vec3 at = {float(random.next()), float(random.next()), float(random.next())};
        const double share = 0.2 + 0.4 * random.next();
        glm::vec3 position = bounds.min + bounds.extent() * at;
        if (i % 4 == 3 && !lights.empty()) {
            const size_t light =
                std::min(size_t(random.next() * double(lights.size())), lights.size() - 1);
            position = lights[light].positionWorld;
            if (lights[light].kind == Light::kSun || distanceSquared(bounds, position) > 0.0f)
                continue;
            moveAside(position, at, random);
        } else if (i % 4 != 2) {
            SurfaceSampler::Point point = surface.draw(random);
            for (int attempt = 0; attempt < 16 && std::fabs(point.normal.y) < 0.7f; ++attempt)
                point = surface.draw(random);
            position = point.position + glm::vec3(0.0f, 1e-4f * diagonal, 0.0f);
        }
        raiseToEyeHeight(position, share);
        position = glm::clamp(position, bounds.min, bounds.max);
        candidates.push_back(probe(position));
    }

    std::vector<float> values;
    const auto gather = [&](float Station::*member) {
        values.clear();
        for (const Station& c : candidates)
            values.push_back(c.*member);
    };
    gather(&Station::backShare);
    typicalBackShare_ = quantile(values, 0.1);
    const auto keep = [&](auto&& condition) { // unless that leaves nothing
        std::vector<Station> kept;
        for (const Station& c : candidates)
            if (condition(c))
                kept.push_back(c);
        if (!kept.empty())
            candidates = std::move(kept);
    };
    keep([&](const Station& c) { return c.backShare <= typicalBackShare_ + 0.1f; });
    gather(&Station::escapeShare);
    const float escapeLimit = std::max(0.55f, quantile(values, 0.25) + 0.25f);
    keep([&](const Station& c) { return c.escapeShare <= escapeLimit; });
    stations_ = std::move(candidates);
    keepVariedRooms();
    candidates = std::move(stations_);
    gather(&Station::openness);
    typicalOpenness_ = quantile(values, 0.75);
    keep([&](const Station& c) { return c.openness >= 0.5f * typicalOpenness_; });
    keep([&](const Station& c) { return c.clearance >= 0.1f * typicalOpenness_; });
    stations_ = std::move(candidates);
}

// Moves a point along a direction that is more level than steep by a random share of its room.
void OpenSpace::moveAside(glm::vec3& position, const glm::vec3& at, PlacementRandom& random) const {
    glm::vec3 aside = at * 2.0f - 1.0f;
    aside.y *= 0.25f;
    const float length = std::sqrt(glm::dot(aside, aside));
    if (length > 0.0f)
        position += (aside / length) *
                    (float(random.next()) * spaceAlong(tree_, bounds_, position, aside / length));
}

std::vector<OpenSpace::Station> OpenSpace::stationsAround(const glm::vec3& point, int tries,
                                                          PlacementRandom& random) const {
    std::vector<Station> found;
    for (int i = 0; i < tries; ++i) {
        const glm::vec3 at = {float(random.next()), float(random.next()), float(random.next())};
        const double share = 0.2 + 0.4 * random.next();
        glm::vec3 position = point;
        if (distanceSquared(bounds_, position) > 0.0f)
            break;
        moveAside(position, at, random);
        raiseToEyeHeight(position, share);
        const Station station = probe(glm::clamp(position, bounds_.min, bounds_.max));
        if (station.backShare <= typicalBackShare_ + 0.1f)
            found.push_back(station);
    }
    return found;
}

// Stations that see each other, directly or over others, share a room. A room counts by the
// triangles that its stations' fans hit, each once: the walls of a gap are few and large.
void OpenSpace::keepVariedRooms() {
    const size_t count = stations_.size();
    std::vector<uint32_t> room(count);
    for (uint32_t i = 0; i < count; ++i)
        room[i] = i;
    const auto rootOf = [&](uint32_t i) {
        while (room[i] != i)
            i = room[i] = room[room[i]];
        return i;
    };
    constexpr size_t kNeighbours = 12;
    std::vector<std::pair<float, uint32_t>> nearest(count);
    for (uint32_t i = 0; i < count; ++i) {
        pollCpu();
        for (uint32_t k = 0; k < count; ++k) {
            const glm::vec3 d = stations_[k].position - stations_[i].position;
            nearest[k] = {glm::dot(d, d), k};
        }
        const size_t tries = std::min(kNeighbours + 1, count); // one is itself
        std::partial_sort(nearest.begin(), nearest.begin() + std::ptrdiff_t(tries), nearest.end());
        for (size_t n = 0; n < tries; ++n) {
            const uint32_t a = rootOf(i), b = rootOf(nearest[n].second);
            if (a != b && sees(stations_[i].position, stations_[nearest[n].second].position))
                room[std::max(a, b)] = std::min(a, b);
        }
    }
    std::vector<std::vector<uint32_t>> seen(count);
    for (uint32_t i = 0; i < count; ++i) {
        pollCpu();
        probe(stations_[i].position, &seen[rootOf(i)]);
    }
    size_t most = 0;
    for (std::vector<uint32_t>& triangles : seen) {
        std::sort(triangles.begin(), triangles.end());
        triangles.erase(std::unique(triangles.begin(), triangles.end()), triangles.end());
        most = std::max(most, triangles.size());
    }
    std::vector<Station> kept;
    for (uint32_t i = 0; i < count; ++i)
        if (double(seen[rootOf(i)].size()) >= 0.3 * double(most))
            kept.push_back(stations_[i]);
    stations_ = std::move(kept);
}

bool OpenSpace::sees(const glm::vec3& from, const glm::vec3& to) const {
    const glm::vec3 d = to - from;
    const float length = std::sqrt(glm::dot(d, d));
    return !(length > 0.0f) || !tree_.isBlocked(from, d / length, length * 0.9999f);
}

int OpenSpace::stationsInSight(const glm::vec3& point, int enough) const {
    constexpr size_t kTries = 12;
    std::vector<std::pair<float, uint32_t>> nearest(stations_.size());
    for (size_t i = 0; i < stations_.size(); ++i) {
        const glm::vec3 d = stations_[i].position - point;
        nearest[i] = {glm::dot(d, d), uint32_t(i)};
    }
    const size_t tries = std::min(kTries, nearest.size());
    std::partial_sort(nearest.begin(), nearest.begin() + std::ptrdiff_t(tries), nearest.end());
    int count = 0;
    for (size_t i = 0; i < tries && count < enough; ++i)
        count += sees(point, stations_[nearest[i].second].position) ? 1 : 0;
    return count;
}

} // namespace shadowdag
