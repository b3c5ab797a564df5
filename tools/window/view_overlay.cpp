// SPDX-License-Identifier: Apache-2.0
#include "tools/window/view_overlay.h"

#include "cuda/parallel_for.h"
#include "hybrid/gbuffer/view_rays.h"
#include "hybrid/rays/shadow_rays.h"
#include "shadowmap/page_mask.h"
#include "tools/settings/parse.h"
#include "tools/workspace/error_image.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

namespace shadowdag {

namespace {

using Ticks = std::vector<std::pair<float, std::string>>;

glm::vec3 greyOf(const glm::vec3& display) {
    return glm::vec3(0.08f + 0.35f * glm::dot(display, glm::vec3(0.2126f, 0.7152f, 0.0722f)));
}

/// Returns a colour of a scale with a little of the scene's brightness, little enough to find the
/// colour on the scale.
glm::vec3 shaded(const glm::vec3& color, const glm::vec3& display) {
    return color * (0.8f + 0.5f * (greyOf(display).x - 0.08f));
}

/// Returns the scene in grey and the reason.
OverlayPicture withoutData(const OverlayInputs& in, const std::string& why) {
    OverlayPicture picture{in.display, {}};
    for (glm::vec3& p : picture.display)
        p = greyOf(p);
    picture.legend.title = why;
    return picture;
}

/// Calls draw(sample, cluster), which returns a colour, for every sample that has a cluster;
/// background stays as displayed.
template <class F> std::vector<glm::vec3> drawSamples(const OverlayInputs& in, const F& draw) {
    std::vector<glm::vec3> picture = in.display;
    const ClusterView clusters = in.renderer.clusters();
    cpuParallelRanges(picture.size(), 1024, [&](size_t begin, size_t end) {
        for (size_t s = begin; s < end; ++s)
            if (const uint32_t cluster = clusters.clusterOfSample[s]; cluster != kNoCluster)
                picture[s] = draw(s, cluster);
    });
    return picture;
}

/// Returns the ticks of a scale by powers of two, every `step`-th named.
Ticks powerTicks(int firstLog2, int lastLog2, int step = 1) {
    Ticks ticks;
    for (int log2 = firstLog2; log2 <= lastLog2; log2 += step)
        ticks.push_back({float(log2 - firstLog2) / float(lastLog2 - firstLog2),
                         numberText(std::ldexp(1.0, log2))});
    return ticks;
}

OverlayPicture drawClusters(const OverlayInputs& in) {
    OverlayPicture picture;
    picture.display = drawSamples(in, [&](size_t s, uint32_t cluster) {
        return glm::mix(greyOf(in.display[s]), hashColor(cluster), 0.6f);
    });
    picture.legend.title =
        "one colour per cluster, " + std::to_string(in.renderer.clusters().count()) + " of them";
    return picture;
}

OverlayPicture drawMethods(const OverlayInputs& in) {
    if (in.frame.pairRoute.size() != in.frame.pairs.count())
        return withoutData(in, "the method of each pair is known once the picture rests");
    OverlayPicture picture;
    picture.display =
        methodPicture(in.display, rayShare(in.frame.pairs, in.frame.pairRoute), in.frame.maps,
                      in.world.lights(), in.camera, in.options.width, in.options.height,
                      float(in.options.height) / float(in.request.options.height));
    picture.legend.title = "method of pairs";
    picture.legend.swatches = {{kSkyBlue, "rays"}, {kOrange, "maps"}};
    return picture;
}

/// Face resolutions: those that clusters request, or those of their maps.
OverlayPicture drawResolution(const OverlayInputs& in, bool isRequested) {
    constexpr int kFirst = 3, kLast = 13;
    const ClusterView clusters = in.renderer.clusters();
    const ClusterLightsView lists = in.renderer.clusterLights();
    const View<const float> wantedSquared = in.renderer.wantedSquared();
    std::vector<float> ofCluster(clusters.count(), 0.0f);
    for (size_t c = 0; c < clusters.count(); ++c)
        for (uint32_t l = lists.start[c]; l < lists.start[c + 1]; ++l) {
            const uint32_t record = lists.record[l];
            if (record == kProvenLit || record >= in.frame.maps.size() ||
                (in.request.light >= 0 && lists.lights[l] != uint32_t(in.request.light)))
                continue;
            const float texels = isRequested ? std::sqrt(wantedSquared[l]) / in.options.undersample
                                             : float(in.frame.maps[record].quantities.faceTexels);
            ofCluster[c] = std::max(ofCluster[c], texels);
        }
    OverlayPicture picture;
    picture.display = drawSamples(in, [&](size_t s, uint32_t cluster) {
        const float texels = ofCluster[cluster];
        if (!(texels > 0.0f))
            return greyOf(in.display[s]);
        const float t = (std::log2(texels) - float(kFirst)) / float(kLast - kFirst);
        return shaded(rampColor(t), in.display[s]);
    });
    picture.legend.title = std::string(isRequested ? "requested" : "allocated") +
                           " texels across a face, " +
                           (in.request.light < 0 ? std::string("most of any light")
                                                 : "light " + std::to_string(in.request.light));
    picture.legend.ticks = powerTicks(kFirst, kLast, 2);
    return picture;
}

/// The record that page overlays show, and its map's index; -1: none is drawn.
struct ChosenMap {
    int record = -1, map = -1;
};

ChosenMap chooseMap(const OverlayInputs& in) {
    ChosenMap chosen;
    const std::vector<PairServer> servers = serversOf(in.frame.maps);
    uint64_t most = 0;
    for (size_t r = 0; r < in.frame.maps.size(); ++r) {
        const MapRecord& map = in.frame.maps[r];
        if (map.route != Route::kMap)
            continue;
        const bool isOf =
            in.request.light < 0 || map.quantities.light == uint32_t(in.request.light);
        if (isOf && (chosen.record < 0 || map.quantities.samples > most)) {
            most = map.quantities.samples;
            chosen = {int(r), int(servers[r].map())};
        }
    }
    return chosen;
}

std::string nameOf(const OverlayInputs& in, const ChosenMap& chosen) {
    const MapRecord& map = in.frame.maps[size_t(chosen.record)];
    return "light " + std::to_string(map.quantities.light) + ", octave " +
           std::to_string(map.quantities.octave);
}

/// Calls draw(sample, face, u, v), u and v in [-1, 1], for the samples of a map.
template <class F>
std::vector<glm::vec3> drawServed(const OverlayInputs& in, const ChosenMap& chosen,
                                  const ShadowMapInfo& map, const F& draw) {
    const ClusterView clusters = in.renderer.clusters();
    const ClusterLightsView lists = in.renderer.clusterLights();
    std::vector<uint8_t> isServed(clusters.count(), 0);
    for (size_t c = 0; c < clusters.count(); ++c)
        for (uint32_t l = lists.start[c]; l < lists.start[c + 1]; ++l)
            isServed[c] |= lists.record[l] == uint32_t(chosen.record);
    const GBufferView gbuffer = in.renderer.gbuffer();
    return drawSamples(in, [&](size_t s, uint32_t cluster) {
        if (!isServed[cluster])
            return greyOf(in.display[s]);
        const glm::vec3 d(lightFromWorld(map, gbuffer.positionWorld[s]));
        const uint32_t face = map.window.isDirectional() ? kDirectionalFace : faceOf(d);
        const glm::vec3 q = faceFromLight(face, d);
        return draw(s, face, q.x / q.z, q.y / q.z);
    });
}

OverlayPicture drawPages(const OverlayInputs& in) {
    const ChosenMap chosen = chooseMap(in);
    if (chosen.map < 0)
        return withoutData(in, "no map of that light is drawn");
    const ShadowMapView maps = in.renderer.shadowMaps();
    const ShadowMapInfo& map = maps.maps[size_t(chosen.map)];
    OverlayPicture picture;
    picture.display = drawServed(in, chosen, map, [&](size_t s, uint32_t face, float u, float v) {
        const uint32_t x = faceCell(u, map.faceTexels), y = faceCell(v, map.faceTexels);
        const uint32_t log2 = maps.pageTexelsLog2;
        const uint32_t entry = pageTableIndex(map, face, x >> log2, y >> log2);
        if (maps.pageTable[entry] == kNoPage)
            return glm::vec3(1.0f, 0.0f, 1.0f);
        const glm::vec3 tint = glm::mix(greyOf(in.display[s]), hashColor(entry), 0.5f);
        return ((x ^ y) & 1u) ? tint : tint * 0.85f; // texels, if they are wider than pixels
    });
    picture.legend.title = nameOf(in, chosen) + ": " + std::to_string(map.faceTexels) +
                           " texels a face, pages of " + std::to_string(1u << maps.pageTexelsLog2) +
                           ", texels as a chequer board";
    return picture;
}

OverlayPicture drawProjections(const OverlayInputs& in) {
    const ChosenMap chosen = chooseMap(in);
    if (chosen.map < 0)
        return withoutData(in, "no map of that light is drawn");
    const ShadowMapInfo& map = in.renderer.shadowMaps().maps[size_t(chosen.map)];
    const View<const uint32_t> words = in.renderer.projectionMaps();
    const size_t first = size_t(chosen.map) * kProjectionWordsPerMap;
    OverlayPicture picture;
    picture.display = drawServed(in, chosen, map, [&](size_t s, uint32_t face, float u, float v) {
        const uint32_t x = faceCell(u, kProjectionMapSize), y = faceCell(v, kProjectionMapSize);
        const bool isSet = words[first + face * kProjectionMapSize + y] >> x & 1u;
        const glm::vec3 tint = isSet ? hashColor(face * 7 + 1) * (((x ^ y) & 1u) ? 1.0f : 0.75f)
                                     : glm::vec3(1.0f, 0.0f, 1.0f);
        return glm::mix(greyOf(in.display[s]), tint, 0.5f);
    });
    picture.legend.title = nameOf(in, chosen) + ": one colour per face, " +
                           std::to_string(kProjectionMapSize) + " cells across";
    return picture;
}

OverlayPicture drawVoxels(const OverlayInputs& in) {
    const DagView dag = in.renderer.rayInputs({}).dag;
    if (dag.rootAddress == kNoNode)
        return withoutData(in, "there are no voxels");
    const uint32_t level = std::min(in.request.voxelLevel, dag.grid.resolutionLog2);
    const ViewRays view = makeViewRays(in.camera, in.options.width, in.options.height);
    const glm::dvec3 origin = dag.grid.voxelFromWorld(view.origin);
    const double reach = 2.0 * glm::length(origin) + 4.0 * double(dag.grid.resolution());
    OverlayPicture picture;
    picture.display.resize(in.display.size());
    cpuParallelRanges(picture.display.size(), 256, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i) {
            const glm::dvec3 way = glm::normalize(
                view.direction(uint32_t(i % in.options.width), uint32_t(i / in.options.width)));
            DagHit hit;
            const DagSegment ray{glm::vec3(origin), glm::vec3(origin + way * reach)};
            if (!occluded(dag, ray, level, &hit)) {
                picture.display[i] = glm::vec3(0.05f);
                continue;
            }
            // The face through which the ray enters the cell: that of the last axis.
            const glm::dvec3 low(hit.cell);
            const double side = double(1u << hit.level);
            int axis = 0;
            double last = -1e300;
            for (int a = 0; a < 3; ++a) {
                const double plane = way[a] > 0.0 ? low[a] : low[a] + side;
                const double t = way[a] == 0.0 ? -1e300 : (plane - origin[a]) / way[a];
                if (t > last) {
                    last = t;
                    axis = a;
                }
            }
            const float facing = float(0.35 + 0.65 * std::abs(way[axis]));
            const glm::uvec3 cell = hit.cell >> hit.level;
            const uint32_t number = cell.x * 73856093u ^ cell.y * 19349663u ^ cell.z * 83492791u;
            picture.display[i] = glm::mix(glm::vec3(0.75f), hashColor(number), 0.25f) * facing;
        }
    });
    picture.legend.title = "cells of " + std::to_string(1u << level) + " voxels, " +
                           numberText(double(1u << level) * dag.grid.voxelSizeWorld) + " m";
    return picture;
}

OverlayPicture drawSteps(const OverlayInputs& in) {
    constexpr int kFirst = 1, kLast = 8; // nodes, log2
    const RayInputs rays = in.renderer.rayInputs(in.options.rays);
    if (rays.dag.rootAddress == kNoNode)
        return withoutData(in, "there are no voxels");
    const ClusterLightsView lists = in.renderer.clusterLights();
    const GBufferView gbuffer = in.renderer.gbuffer();
    const std::vector<Light>& lights = in.world.lights();
    OverlayPicture picture;
    picture.display = drawSamples(in, [&](size_t s, uint32_t cluster) {
        uint64_t visits = 0, count = 0;
        for (uint32_t l = lists.start[cluster]; l < lists.start[cluster + 1]; ++l) {
            const uint32_t index = lists.lights[l];
            const Light& light = lights[index];
            const glm::vec3 p = gbuffer.positionWorld[s], n = gbuffer.normalWorld[s];
            if ((in.request.light >= 0 && index != uint32_t(in.request.light)) ||
                !isPair(light, p, n))
                continue;
            const ShadowPair pair{p,
                                  n,
                                  pointAtLight(light, p),
                                  gbuffer.triangle[s],
                                  index,
                                  light.kind == Light::kSun};
            const PairSegment segment = pairSegment(rays, pair);
            visits += countDagVisits(rays.dag, segment.segment, segment.startLevel);
            ++count;
        }
        if (count == 0)
            return greyOf(in.display[s]);
        const float mean = float(double(visits) / double(count));
        const float t = (std::log2(std::max(mean, 1.0f)) - float(kFirst)) / float(kLast - kFirst);
        return shaded(rampColor(t), in.display[s]);
    });
    picture.legend.title =
        "nodes and leaves read by rays to a pixel's lights, mean (also for lights that use maps)";
    picture.legend.ticks = powerTicks(kFirst, kLast);
    return picture;
}

OverlayPicture drawErrors(const OverlayInputs& in) {
    if (in.truth.size() != in.frame.pairs.count() || in.frame.visibility.size() != in.truth.size())
        return withoutData(in, "errors are known once the picture rests");
    PixelErrors errors = countPixelErrors(in.frame.pairs, in.frame.visibility, in.truth);
    const auto none = [](std::vector<float>& counts) {
        std::fill(counts.begin(), counts.end(), 0.0f);
    };
    const bool hasShadow = in.request.overlay != ViewOverlay::kFalseLight;
    const bool hasLight = in.request.overlay != ViewOverlay::kFalseShadow;
    OverlayPicture picture;
    picture.legend.title = "wrong pairs of a pixel";
    if (hasShadow)
        picture.legend.swatches.push_back({kVermilion, "false shadow"});
    else
        none(errors.falseShadow);
    if (hasLight)
        picture.legend.swatches.push_back({kBlue, "false light"});
    else
        none(errors.falseLight);
    picture.display = errorPicture(in.display, errors);
    return picture;
}

} // namespace

glm::vec3 rampColor(float t) {
    // Lightness rises from 0.14 to 0.92; blue to yellow survives every common colour blindness.
    constexpr std::array<glm::vec3, 5> kStops{glm::vec3(0.00f, 0.13f, 0.32f),
                                              {0.27f, 0.32f, 0.42f},
                                              {0.48f, 0.48f, 0.47f},
                                              {0.72f, 0.66f, 0.42f},
                                              {0.99f, 0.91f, 0.27f}};
    const float at = std::clamp(t, 0.0f, 1.0f) * float(kStops.size() - 1);
    const size_t i = std::min(size_t(at), kStops.size() - 2);
    return glm::mix(kStops[i], kStops[i + 1], at - float(i));
}

glm::vec3 hashColor(uint32_t number) {
    uint32_t h = number * 2654435761u;
    h ^= h >> 15;
    h *= 2246822519u;
    h ^= h >> 13;
    const float hue = float(h & 0xffffu) / 65536.0f * 6.0f;
    const float value = 0.65f + 0.35f * float(h >> 16 & 0xffu) / 255.0f;
    const auto channel = [&](float shift) {
        const float k = std::fmod(hue + shift, 6.0f);
        return value * (1.0f - 0.7f * std::clamp(std::min(k, 4.0f - k), 0.0f, 1.0f));
    };
    return {channel(5.0f), channel(3.0f), channel(1.0f)};
}

OverlayPicture drawOverlay(const OverlayInputs& in) {
    switch (in.request.overlay) {
    case ViewOverlay::kNone:
        return {in.display, {}};
    case ViewOverlay::kClusters:
        return drawClusters(in);
    case ViewOverlay::kMethods:
        return drawMethods(in);
    case ViewOverlay::kRequested:
        return drawResolution(in, true);
    case ViewOverlay::kAllocated:
        return drawResolution(in, false);
    case ViewOverlay::kPages:
        return drawPages(in);
    case ViewOverlay::kProjections:
        return drawProjections(in);
    case ViewOverlay::kVoxels:
        return drawVoxels(in);
    case ViewOverlay::kSteps:
        return drawSteps(in);
    case ViewOverlay::kErrors:
    case ViewOverlay::kFalseShadow:
    case ViewOverlay::kFalseLight:
        return drawErrors(in);
    }
    return {in.display, {}};
}

UnfoldedMap drawUnfoldedMap(const OverlayInputs& in) {
    const ChosenMap chosen = chooseMap(in);
    if (chosen.map < 0)
        return {};
    const ShadowMapView maps = in.renderer.shadowMaps();
    const ShadowMapInfo& map = maps.maps[size_t(chosen.map)];
    const View<const uint32_t> words = in.renderer.projectionMaps();
    const size_t first = size_t(chosen.map) * kProjectionWordsPerMap;
    constexpr uint32_t kFaceSide = 96;
    // Positions of faces +x -x +y -y +z -z, in faces from the top left.
    constexpr std::array<glm::uvec2, kFaceCount> kPlace{glm::uvec2(2, 1), {0, 1}, {1, 0},
                                                        {1, 2},           {1, 1}, {3, 1}};
    const bool isDirectional = map.window.isDirectional();
    UnfoldedMap picture;
    picture.width = isDirectional ? 2 * kFaceSide : 4 * kFaceSide;
    picture.height = isDirectional ? 2 * kFaceSide : 3 * kFaceSide;
    picture.rgba.assign(size_t(picture.width) * picture.height * 4, 0);
    const float nearest = isDirectional ? 2.0f : 8.0f / map.rangeWorld;
    uint32_t pageCount = 0;
    for (uint32_t face = 0; face < kFaceCount; ++face) {
        if (!(facesOf(map) >> face & 1u))
            continue;
        for (uint32_t y = 0; y < map.facePages; ++y)
            for (uint32_t x = 0; x < map.facePages; ++x)
                pageCount += maps.pageTable[pageTableIndex(map, face, x, y)] != kNoPage;
        const uint32_t side = isDirectional ? 2 * kFaceSide : kFaceSide;
        for (uint32_t y = 0; y < side; ++y)
            for (uint32_t x = 0; x < side; ++x) {
                const CubeTexel texel{face, x * map.faceTexels / side, y * map.faceTexels / side};
                const uint32_t bits = depthAt(maps, map, texel);
                const uint32_t u = x * kProjectionMapSize / side, v = y * kProjectionMapSize / side;
                const bool isSet = words[first + face * kProjectionMapSize + v] >> u & 1u;
                glm::vec3 color(0.03f, 0.05f, 0.16f);
                if (bits != kNoPage) {
                    const float depth = std::bit_cast<float>(bits); // 1/z, 0 where nothing is
                    const float t =
                        depth > 0.0f ? std::sqrt(std::min(depth / nearest, 1.0f)) : 0.0f;
                    color = glm::vec3(0.12f + 0.85f * t);
                    if (depth == 0.0f)
                        color = glm::vec3(0.10f, 0.16f, 0.10f);
                    const uint32_t log2 = maps.pageTexelsLog2;
                    const bool isEdge =
                        x > 0 && y > 0 &&
                        (texel.x >> log2 != (x - 1) * map.faceTexels / side >> log2 ||
                         texel.y >> log2 != (y - 1) * map.faceTexels / side >> log2);
                    if (isEdge)
                        color = glm::mix(color, glm::vec3(0.34f, 0.71f, 0.91f), 0.35f);
                }
                if (!isSet)
                    color *= 0.55f;
                // v rises upwards on a face, rows run downwards in a picture.
                const uint32_t px = (isDirectional ? 0 : kPlace[face].x * kFaceSide) + x;
                const uint32_t py =
                    (isDirectional ? 0 : kPlace[face].y * kFaceSide) + (side - 1 - y);
                uint8_t* const out = &picture.rgba[(size_t(py) * picture.width + px) * 4];
                for (int c = 0; c < 3; ++c)
                    out[c] = uint8_t(std::lround(255.0f * std::clamp(color[c], 0.0f, 1.0f)));
                out[3] = 255;
            }
    }
    picture.title = nameOf(in, chosen) + ": " + std::to_string(map.faceTexels) +
                    " texels a face, " + std::to_string(pageCount) + " pages";
    return picture;
}

} // namespace shadowdag
