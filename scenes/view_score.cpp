// SPDX-License-Identifier: Apache-2.0
#include "scenes/view_score.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace shadowdag {

namespace {

constexpr int kDepthBinCount = 8, kNormalBinCount = 6;

float share(size_t count, size_t of) {
    return of > 0 ? float(count) / float(of) : 0.0f;
}

/// Returns 1 up to an excess of 0, then less, 0 from 1 on.
float penalty(float excess) {
    const float rest = std::max(0.0f, 1.0f - std::max(0.0f, excess));
    return rest * rest;
}

} // namespace

size_t ViewLight::seenCount() const {
    return size_t(std::count(isSeen.begin(), isSeen.end(), 1));
}

ViewLight& ViewLight::operator+=(const ViewLight& other) {
    hitCount += other.hitCount;
    pairCount += other.pairCount;
    tracedCount += other.tracedCount;
    darkCount += other.darkCount;
    reachedCount += other.reachedCount;
    litCount += other.litCount;
    isSeen.resize(std::max(isSeen.size(), other.isSeen.size()), 0);
    for (size_t l = 0; l < other.isSeen.size(); ++l)
        isSeen[l] |= other.isSeen[l];
    return *this;
}

ViewScore::ViewScore(const World& world, const OpenSpace& open, float unit)
    : world_(world), open_(open), unit_(std::max(unit, 1e-30f)) {
    std::vector<float> escapes;
    for (const OpenSpace::Station& station : open.stations())
        escapes.push_back(station.escapeShare);
    const auto quarter = escapes.begin() + std::ptrdiff_t(escapes.size() / 4);
    std::nth_element(escapes.begin(), quarter, escapes.end());
    typicalEscape_ = *quarter;
}

ViewSample ViewScore::look(const glm::vec3& eye, const glm::vec3& d) const {
    const TriangleTree::Hit hit = open_.tree().trace(eye, d);
    if (!std::isfinite(hit.distance))
        return {};
    const TriangleView triangles = world_.triangles();
    const glm::vec3 a = triangles.vertex(hit.triangle, 0);
    glm::vec3 normal =
        glm::cross(triangles.vertex(hit.triangle, 1) - a, triangles.vertex(hit.triangle, 2) - a);
    const float length = std::sqrt(glm::dot(normal, normal));
    if (length > 0.0f)
        normal *= (glm::dot(normal, d) > 0.0f ? -1.0f : 1.0f) / length;
    return {true, hit.isFrontFace, hit.distance, eye + d * hit.distance, normal};
}

ViewLight ViewScore::light(const std::vector<ViewSample>& view, size_t raysASample) const {
    const std::vector<Light>& lights = world_.lights();
    ViewLight result;
    result.isSeen.assign(lights.size(), 0);
    const float lift = 1e-3f * unit_;
    std::vector<uint32_t> reaching;
    for (size_t i = 0; i < view.size(); ++i) {
        const ViewSample& s = view[i];
        if (!s.isHit)
            continue;
        ++result.hitCount;
        reaching.clear();
        for (uint32_t l = 0; l < lights.size(); ++l)
            if (lightReaches(lights[l], s.position) &&
                glm::dot(towardsLight(lights[l], s.position), s.normal) > 0.0f)
                reaching.push_back(l);
        result.pairCount += reaching.size();
        result.reachedCount += reaching.empty() ? 0 : 1;
        const size_t rays = std::min(raysASample, reaching.size());
        bool isLit = false;
        for (size_t r = 0; r < rays; ++r) {
            // Spread over the list, another start each sample: no light is left out by its place.
            const uint32_t l = reaching[(r * reaching.size() / rays + i) % reaching.size()];
            ++result.tracedCount;
            if (open_.sees(s.position + s.normal * lift, pointAtLight(lights[l], s.position))) {
                result.isSeen[l] = 1;
                isLit = true;
            } else
                ++result.darkCount;
        }
        result.litCount += isLit ? 1 : 0;
    }
    return result;
}

float ViewScore::shape(const std::vector<ViewSample>& view, int width, float allowedEscape) const {
    const float unit = unit_;
    const int height = int(view.size()) / width;
    size_t hitCount = 0, backCount = 0, nearCount = 0, edgeCount = 0;
    float reach = 0.0f;
    std::array<size_t, kDepthBinCount * kNormalBinCount> bins{};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const ViewSample& s = view[size_t(y * width + x)];
            if (x + 1 < width && isEdge(s, view[size_t(y * width + x + 1)]))
                ++edgeCount;
            if (y + 1 < height && isEdge(s, view[size_t((y + 1) * width + x)]))
                ++edgeCount;
            if (!s.isHit)
                continue;
            ++hitCount;
            backCount += s.isFront ? 0 : 1;
            nearCount += s.distance < 0.3f * unit ? 1 : 0;
            reach += s.distance / (s.distance + 2.0f * unit);
            ++bins[size_t(binOf(s, unit))];
        }
    if (hitCount == 0)
        return 0.0f;
    float same = 0.0f; // the chance that two samples fall into the same bin
    for (const size_t count : bins)
        same += share(count, hitCount) * share(count, hitCount);
    const float edges =
        float(edgeCount) / float(std::max(1, (width - 1) * height + width * (height - 1)));
    const float escape = 1.0f - share(hitCount, view.size());
    return reach / float(hitCount) * (1.2f - same) * (0.5f + std::min(edges, 0.5f)) *
           penalty(2.0f * share(nearCount, hitCount)) *
           penalty(escape - std::max(allowedEscape, typicalEscape_)) *
           penalty(2.0f * (share(backCount, hitCount) - open_.typicalBackShare()));
}

float ViewScore::wholeObjects(const std::vector<ViewSample>& view, int width) const {
    const size_t count = view.size(), columns = size_t(width);
    std::vector<uint32_t> part(count);
    std::iota(part.begin(), part.end(), 0u);
    const auto rootOf = [&](uint32_t i) {
        while (part[i] != i)
            i = part[i] = part[part[i]];
        return i;
    };
    const auto join = [&](size_t a, size_t b) {
        if (isEdge(view[a], view[b]))
            return;
        const uint32_t ra = rootOf(uint32_t(a)), rb = rootOf(uint32_t(b));
        part[std::max(ra, rb)] = std::min(ra, rb);
    };
    for (size_t i = 0; i < count; ++i) {
        if ((i + 1) % columns != 0)
            join(i, i + 1);
        if (i + columns < count)
            join(i, i + columns);
    }
    std::vector<float> distances;
    std::vector<uint32_t> size(count, 0);
    std::vector<uint8_t> isCut(count, 0);
    for (size_t i = 0; i < count; ++i) {
        const uint32_t root = rootOf(uint32_t(i));
        ++size[root];
        const bool isBorder =
            i % columns == 0 || (i + 1) % columns == 0 || i < columns || i + columns >= count;
        isCut[root] |= isBorder ? 1 : 0;
        if (view[i].isHit)
            distances.push_back(view[i].distance);
    }
    if (distances.empty())
        return 0.5f;
    const auto middle = distances.begin() + std::ptrdiff_t(distances.size() / 2);
    std::nth_element(distances.begin(), middle, distances.end());
    size_t wholeCount = 0, cutCount = 0;
    for (size_t i = 0; i < count; ++i) {
        const uint32_t root = rootOf(uint32_t(i));
        if (!view[i].isHit)
            continue;
        wholeCount += !isCut[root] && size[root] >= 2 ? 1 : 0;
        // Small and near at the frame's border: the foreground, cut off.
        cutCount += isCut[root] && view[i].distance < 0.5f * *middle && size[root] < count / 4;
    }
    return 0.7f + 0.3f * std::min(1.0f, share(wholeCount, count) / 0.15f) -
           0.2f * std::min(1.0f, share(cutCount, count) / 0.15f);
}

float ViewScore::lightWorth(const ViewLight& light) const {
    const size_t lightCount = world_.lights().size();
    if (lightCount == 0)
        return 1.0f;
    const float mean = share(light.pairCount, light.hitCount);
    const float many = mean / (mean + 4.0f) * std::min(1.0f, 16.0f / (mean + 1e-6f));
    // Half the worth at an eighth of the lights, at most at 16 of them: a view of three lights of
    // hundreds is worth little, one of three of five much.
    const float half = std::clamp(float(lightCount) / 8.0f, 1.0f, 16.0f);
    const auto seen = float(light.seenCount());
    const float reached = share(light.reachedCount, light.hitCount);
    float dark = 1.0f, lit = 1.0f;
    if (light.tracedCount > 0) {
        const float of = share(light.darkCount, light.tracedCount);
        dark = 0.4f + 2.0f * std::min(of, 0.3f) - std::max(0.0f, of - 0.6f);
        lit = std::min(1.0f, 2.0f * share(light.litCount, light.hitCount));
    }
    return 0.02f + many * seen / (seen + half) * dark * lit * reached * reached;
}

bool ViewScore::isEdge(const ViewSample& a, const ViewSample& b) {
    if (!a.isHit || !b.isHit)
        return a.isHit != b.isHit;
    return a.distance > 1.3f * b.distance || b.distance > 1.3f * a.distance ||
           glm::dot(a.normal, b.normal) < 0.7f;
}

/// Octaves of distance, 1/8 to 8 units and beyond, by where the normal points most.
int ViewScore::binOf(const ViewSample& s, float unit) {
    int depth = 0;
    for (float limit = 0.125f * unit; depth + 1 < kDepthBinCount && s.distance > limit;
         limit *= 2.0f)
        ++depth;
    const glm::vec3 n = glm::abs(s.normal);
    const int axis = n.x >= n.y ? (n.x >= n.z ? 0 : 2) : (n.y >= n.z ? 1 : 2);
    return (depth * 3 + axis) * 2 + (s.normal[axis] < 0.0f ? 1 : 0);
}

} // namespace shadowdag
