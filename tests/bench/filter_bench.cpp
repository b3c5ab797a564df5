// SPDX-License-Identifier: Apache-2.0
// Effects of bias and filter of a map's lookup, on standard output as one JSON object, for
// shadowmap/FILTERS.md and `shadowdag_report bias` (tools/report):
// "acne": on surfaces alone in the world, the share of points, lit by Embree, that a lookup calls
//   dark (under one half), by the light's angle and the bias;
// "detached": behind a wall on a plane, how far from its foot the floor is lit, in texels of that
//   place, by angle and bias;
// "filters": on built-in scenes, errors against Embree and time a lookup, by taps and bias.
// Points are seeded; times are of one thread, median of interleaved rounds.
#include "scenes/builtin.h"
#include "scenes/world.h"
#include "tests/shadowmap/small_scene.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <string>
#include <vector>

namespace shadowdag {
namespace {

using test::DrawnMap;
using test::Oracle;
using test::SmallScene;

const float kBiases[] = {0.0f, 0.125f, 0.25f, 0.5f, 1.0f, 2.0f};
const float kAngles[] = {5, 15, 25, 35, 45, 55, 65, 75, 80, 85};

struct Receiver {
    glm::vec3 position, normal;
};

glm::vec3 perpendicular(const glm::vec3& n) {
    return glm::normalize(
        glm::cross(n, std::abs(n.x) < 0.9f ? glm::vec3(1, 0, 0) : glm::vec3(0, 0, 1)));
}

bool isLit(const Oracle& oracle, const glm::vec3& light, const glm::vec3& point) {
    return oracle.firstHit(light, point - light, 0.0f, 1.0f - 1e-4f) > 1.0f;
}

ShadowMapBias makeBias(float texels, uint32_t taps) {
    ShadowMapBias bias;
    bias.constantTexels = texels;
    bias.taps = taps;
    return bias;
}

/// A surface around the origin whose middle faces `normal`, of size about 1.
struct Shape {
    const char* name;
    glm::vec3 normal;
    void (*add)(SmallScene&, const glm::vec3& normal);
};

void addPlane(SmallScene& scene, const glm::vec3& normal) {
    const glm::vec3 u = perpendicular(normal);
    scene.addQuad(glm::vec3(0), 3.0f * u, 3.0f * glm::cross(normal, u), 3);
}

/// Two half planes that meet in a concave fold of 180 - 2 * bend degrees.
template <int kBend> void addFold(SmallScene& scene, const glm::vec3& normal) {
    const float bend = float(kBend) * float(M_PI) / 180.0f;
    const glm::vec3 u = perpendicular(normal), v = glm::cross(normal, u);
    for (const float side : {-1.0f, 1.0f}) {
        const glm::vec3 out = std::cos(bend) * side * u + std::sin(bend) * normal;
        scene.addQuad(out, out, 3.0f * v, 1);
    }
}

/// A bowl of facets: 32 across.
void addBowl(SmallScene& scene, const glm::vec3& normal) {
    scene.addSphere(2.0f * normal, 2.0f, 32);
}

const Shape kShapes[] = {{"plane along the axes", {0, 1, 0}, addPlane},
                         {"plane askew", {0.36f, 0.8f, 0.48f}, addPlane},
                         {"fold of 90 degrees", {0.36f, 0.8f, 0.48f}, addFold<45>},
                         {"fold of 170 degrees", {0.36f, 0.8f, 0.48f}, addFold<5>},
                         {"bowl of facets", {0.36f, 0.8f, 0.48f}, addBowl}};

/// Returns points of the scene's triangles within 0.3 of the origin, on the light's side.
std::vector<Receiver> receiversNear(const SmallScene& scene, const glm::vec3& light,
                                    std::mt19937& rng, size_t count) {
    std::uniform_real_distribution<float> unit(-1.0f, 1.0f);
    const Oracle oracle(scene);
    std::vector<Receiver> receivers;
    for (size_t tries = 0; receivers.size() < count && tries < 20 * count; ++tries) {
        const glm::vec3 aim = 0.3f * glm::vec3(unit(rng), unit(rng), unit(rng));
        uint32_t triangle = 0;
        const float t = oracle.firstHit(light, aim - light, 0.0f, 10.0f, &triangle);
        if (!(t < 10.0f))
            continue;
        const glm::uvec3 c = scene.triangles[triangle];
        glm::vec3 n = glm::normalize(glm::cross(scene.positions[c.y] - scene.positions[c.x],
                                                scene.positions[c.z] - scene.positions[c.x]));
        const glm::vec3 p = light + t * (aim - light);
        if (glm::dot(n, light - p) < 0.0f)
            n = -n;
        receivers.push_back({p, n}); // the first that the light meets: lit
    }
    return receivers;
}

void printAcne() {
    const char* separator = "";
    std::printf("\"acne\": [");
    for (const Shape& shape : kShapes)
        for (const float degrees : kAngles) {
            const float angle = degrees * float(M_PI) / 180.0f;
            const glm::vec3 light = 1.5f * (std::cos(angle) * shape.normal +
                                            std::sin(angle) * perpendicular(shape.normal));
            SmallScene scene;
            shape.add(scene, shape.normal);
            std::mt19937 rng(1);
            for (const uint32_t n : {64u, 512u}) {
                const std::vector<Receiver> receivers = receiversNear(scene, light, rng, 4000);
                const DrawnMap drawn(scene, light, 8.0f, n);
                for (const float texels : kBiases) {
                    size_t dark = 0;
                    for (const Receiver& r : receivers)
                        dark += lookupVisibility(drawn.maps.view(), 0, r.position, r.normal,
                                                 makeBias(texels, 9)) < 128;
                    std::printf("%s\n  {\"shape\": \"%s\", \"angle_degrees\": %g, "
                                "\"face_texels\": %u, \"bias_texels\": %g, "
                                "\"point_count\": %zu, \"dark_count\": %zu}",
                                separator, shape.name, double(degrees), n, double(texels),
                                receivers.size(), dark);
                    separator = ",";
                }
            }
        }
    std::printf("],\n");
}

void printDetached() {
    constexpr int kPlaces = 16; // of the wall among the texels
    const uint32_t n = 512;
    const char* separator = "";
    std::printf("\"detached\": [");
    for (const float degrees : kAngles) {
        const float angle = degrees * float(M_PI) / 180.0f;
        std::vector<double> litTexels[std::size(kBiases)];
        for (int place = 0; place < kPlaces; ++place) {
            SmallScene scene;
            scene.addQuad({0, 0, 0}, {8, 0, 0}, {0, 0, 8}, 3);
            scene.addQuad({0, 0, 0}, {0, 1, 0}, {0, 0, 6}, 2); // a wall, seen from -x
            const float shift = 0.07f * float(place) / float(kPlaces);
            const glm::vec3 light(-3.0f * std::sin(angle) - shift, 3.0f * std::cos(angle), 0.3f);
            const DrawnMap drawn(scene, light, 30.0f, n);
            for (size_t b = 0; b < std::size(kBiases); ++b)
                for (int k = 0; k < 20; ++k) { // the first dark point behind the wall
                    const float z = 0.05f * float(k);
                    float x = 1e-4f;
                    while (x < 1.0f && lookupVisibility(drawn.maps.view(), 0, {x, 0, z}, {0, 1, 0},
                                                        makeBias(kBiases[b], 9)) >= 128)
                        x *= 1.02f;
                    const glm::vec3 m = glm::abs(glm::vec3(x, 0, z) - light);
                    litTexels[b].push_back(
                        double(x * float(n) / (2.0f * glm::max(m.x, glm::max(m.y, m.z)))));
                }
        }
        for (size_t b = 0; b < std::size(kBiases); ++b) {
            double sum = 0.0;
            for (const double texels : litTexels[b])
                sum += texels;
            std::printf("%s\n  {\"angle_degrees\": %g, \"bias_texels\": %g, "
                        "\"lit_texels_mean\": %.4g, \"lit_texels_max\": %.4g}",
                        separator, double(degrees), double(kBiases[b]),
                        sum / double(litTexels[b].size()),
                        *std::max_element(litTexels[b].begin(), litTexels[b].end()));
            separator = ",";
        }
    }
    std::printf("],\n");
}

void printFilters() {
    const char* separator = "";
    std::printf("\"filters\": [");
    for (const char* name : {"atrium", "houses"}) {
        const Scene source = makeBuiltin(name);
        const World world(source, {});
        SmallScene scene;
        const TriangleView triangles = world.triangles();
        scene.positions.assign(triangles.positions.data,
                               triangles.positions.data + triangles.positions.count);
        for (size_t t = 0; t < triangles.triangles.count; ++t)
            scene.triangles.push_back(triangles.triangles[t]);
        const Oracle oracle(scene);
        const BatchSet batches(triangles, world.triangleInstance());
        const uint32_t n = 512, mapCount = 8;
        std::vector<MapRequest> requests;
        std::vector<Box> boxes;
        std::vector<MapReceiver> readers;
        for (uint32_t m = 0; m < mapCount; ++m) {
            const Light& light = world.lights()[m * world.lights().size() / mapCount];
            requests.push_back({light.positionWorld, light.rangeWorld, m, n});
            boxes.push_back(test::wholeBox(light.positionWorld, light.rangeWorld));
            readers.push_back({m, m});
        }
        ShadowMaps maps(Backend::kCpu);
        StageTimes stages;
        maps.build(requests, boxes, readers, triangles, batches.view(), {}, stages);

        struct Asked {
            uint32_t map;
            Receiver receiver;
            bool isLit;
        };
        std::vector<Asked> asked;
        std::mt19937 rng(7);
        std::uniform_real_distribution<float> unit(0.0f, 1.0f);
        size_t occluded = 0;
        for (uint32_t m = 0; m < mapCount; ++m) {
            const glm::vec3 light = requests[m].lightPositionWorld;
            // Points behind one another along random rays, lit or not.
            for (int k = 0; k < 1500; ++k) {
                const glm::vec3 d = test::randomDirection(rng);
                float from = 0.0f;
                for (int hit = 0; hit < 4; ++hit) {
                    uint32_t t = 0;
                    const float at = oracle.firstHit(light, d, from, requests[m].rangeWorld, &t);
                    if (!(at < requests[m].rangeWorld))
                        break;
                    from = at * 1.0001f;
                    const glm::uvec3 c = scene.triangles[t];
                    const glm::vec3 cross = glm::cross(scene.positions[c.y] - scene.positions[c.x],
                                                       scene.positions[c.z] - scene.positions[c.x]);
                    if (!(glm::length(cross) > 0.0f))
                        continue;
                    Receiver r{light + at * d, glm::normalize(cross)};
                    if (glm::dot(r.normal, d) > 0.0f)
                        r.normal = -r.normal;
                    // A few neighbours, as pixels have them.
                    const glm::vec3 u = perpendicular(r.normal), v = glm::cross(r.normal, u);
                    for (int i = 0; i < 8; ++i) {
                        Receiver beside = r;
                        beside.position +=
                            0.02f * ((unit(rng) - 0.5f) * u + (unit(rng) - 0.5f) * v);
                        uint32_t same = 0;
                        const float back =
                            oracle.firstHit(light, beside.position - light, 0.999f, 1.001f, &same);
                        if (same != t || !(back < 1.001f))
                            continue; // beyond the triangle
                        asked.push_back({m, beside, isLit(oracle, light, beside.position)});
                        occluded += !asked.back().isLit;
                    }
                }
            }
        }
        constexpr int kRounds = 9;
        struct Row {
            uint32_t taps;
            float texels;
            size_t falseShadow = 0, falseLight = 0;
            double error = 0;
            std::vector<double> ns;
        };
        std::vector<Row> rows;
        for (const uint32_t taps : {1u, 4u, 9u})
            for (const float texels : kBiases)
                rows.push_back({taps, texels, 0, 0, 0, {}});
        for (int round = 0; round < kRounds; ++round)
            for (Row& row : rows) {
                const ShadowMapBias bias = makeBias(row.texels, row.taps);
                const ShadowMapView view = maps.view();
                std::vector<uint8_t> answers(asked.size());
                const auto start = std::chrono::steady_clock::now();
                for (size_t i = 0; i < asked.size(); ++i)
                    answers[i] = lookupVisibility(view, asked[i].map, asked[i].receiver.position,
                                                  asked[i].receiver.normal, bias);
                const std::chrono::duration<double, std::nano> time =
                    std::chrono::steady_clock::now() - start;
                row.ns.push_back(time.count() / double(asked.size()));
                if (round != 0)
                    continue;
                for (size_t i = 0; i < asked.size(); ++i) {
                    row.falseShadow += asked[i].isLit && answers[i] < 128;
                    row.falseLight += !asked[i].isLit && answers[i] >= 128;
                    row.error += std::abs(answers[i] / 255.0 - double(asked[i].isLit));
                }
            }
        for (Row& row : rows) {
            std::sort(row.ns.begin(), row.ns.end());
            std::printf("%s\n  {\"scene\": \"%s\", \"taps\": %u, \"bias_texels\": %g, "
                        "\"point_count\": %zu, \"occluded_count\": %zu, "
                        "\"false_shadow_count\": %zu, \"false_light_count\": %zu, "
                        "\"mean_error\": %.5f, \"ns\": %.2f, \"ns_min\": %.2f, \"ns_max\": %.2f}",
                        separator, name, row.taps, double(row.texels), asked.size(), occluded,
                        row.falseShadow, row.falseLight, row.error / double(asked.size()),
                        row.ns[kRounds / 2], row.ns.front(), row.ns.back());
            separator = ",";
        }
    }
    std::printf("]\n");
}

} // namespace
} // namespace shadowdag

int main() {
    std::printf("{");
    shadowdag::printAcne();
    shadowdag::printDetached();
    shadowdag::printFilters();
    std::printf("}\n");
    return 0;
}
