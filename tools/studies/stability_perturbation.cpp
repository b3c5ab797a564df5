// SPDX-License-Identifier: Apache-2.0
// Stability under perturbation: a scene moved by a thousandth of a voxel or texel, shifted far from
// the origin, scaled and turned; the error of every method compared with the unperturbed one.
#include "tools/studies/stability.h"
#include "tools/studies/stability_stage.h"

#include "cuda/error.h"

#include <algorithm>
#include <cmath>

namespace shadowdag {

namespace {

/// The units of tiny motions, scene units.
struct Units {
    double voxel, texel;
};

SceneMotion motionOf(const Perturbation& p, const Units& units) {
    SceneMotion motion;
    // A direction along no axis and no diagonal, of length 1.
    const glm::dvec3 aside(0.6, 0.48, 0.64);
    glm::dvec3* const shifts[] = {&motion.lightShift, &motion.cameraShift, &motion.geometryShift};
    if (p.by != 0)
        *shifts[p.part] = aside * (p.by * (p.isTexel ? units.texel : units.voxel));
    motion.shift = glm::dvec3(2, 1, -2) * (p.shift / 3.0);
    motion.scale = p.scale;
    if (p.degrees != 0)
        motion.rotation = glm::angleAxis(glm::radians(p.degrees),
                                         p.isAboutX ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0));
    return motion;
}

/// Returns the texel of light 0's finest map at the mean sample's distance, scene units.
double texelOf(const ShadowMapView& maps, const World& world, const GBufferView& gbuffer) {
    const glm::vec3 light = world.lights().at(0).positionWorld;
    glm::dvec3 mean(0.0);
    double count = 0;
    for (size_t i = 0; i < gbuffer.count(); ++i)
        if (gbuffer.triangle[i] != kBackground) {
            mean += glm::dvec3(gbuffer.positionWorld[i]);
            ++count;
        }
    uint32_t faceTexels = 1;
    for (size_t m = 0; m < maps.maps.count; ++m)
        if (maps.maps[m].lightPositionWorld == light)
            faceTexels = std::max(faceTexels, maps.maps[m].faceTexels);
    return 2.0 * glm::length(mean / std::max(count, 1.0) - glm::dvec3(light)) / faceTexels;
}

/// Returns the spacing of floats at the largest coordinate of the bounds.
double spacingAt(const Box& bounds) {
    const glm::vec3 largest = glm::max(glm::abs(bounds.min), glm::abs(bounds.max));
    const float m = std::max(largest.x, std::max(largest.y, largest.z));
    return double(std::nextafter(m, INFINITY)) - double(m);
}

} // namespace

void measurePerturbation(const StabilityTable& table, const StabilityGroup& group, Json& results) {
    const Scene scene = stabilityScene(group);
    // Voxels of about 20 mm in scenes of 10 m.
    const std::vector<std::string> settings = stabilitySettings(table, group);
    const uint32_t resolutionLog2 = cellSetup(settings).resolutionLog2,
                   taps = cellSetup(settings).frame.bias.taps;
    Units units{};
    {
        Workspace workspace(loadedScene(scene), {table.backend, "", {}});
        Judge judge(workspace);
        units.voxel = workspace.grid(resolutionLog2).voxelSizeWorld;
        StabilityMethod(MatrixMethod::kMaps, settings, table.width)
            .measure(workspace, judge, 0, [&](const ErrorInputs& inputs) {
                units.texel = texelOf(inputs.method.maps, workspace.world(), inputs.gbuffer);
            });
    }
    struct Base {
        double wrongShare, meanError, unexplained, unnamed, texels;
    };
    std::vector<Base> bases;
    std::vector<Perturbation> all = {{"unperturbed", "unperturbed"}};
    all.insert(all.end(), table.perturbations.begin(), table.perturbations.end());
    for (const Perturbation& p : all) {
        const SceneMotion motion = motionOf(p, units);
        Workspace workspace(loadedScene(movedScene(scene, motion)), {table.backend, "", {}});
        Judge judge(workspace);
        const double voxel = workspace.grid(resolutionLog2).voxelSizeWorld / motion.scale;
        const double spacing = spacingAt(workspace.world().boundsWorld()) / motion.scale;
        for (int m = 0; m < kMatrixMethodCount; ++m) {
            const MatrixMethod method = MatrixMethod(m);
            workspace.renderer(resolutionLog2).reset();
            const StabilityFrame result =
                StabilityMethod(method, settings, table.width).measure(workspace, judge);
            const ErrorCounts& e = result.errors;
            const double pairs = double(e.pairCount);
            double texels = 0;
            for (const MapRecord& map : result.frame.maps)
                texels = std::max(texels, double(map.quantities.faceTexels));
            Json row = {{"group", group.name},
                        {"case", p.name},
                        {"kind", p.kind + group.kind},
                        {"method", kMatrixMethodNames[m]}};
            requireEvidence(row, e.pairCount, e.occludedCount);
            const uint64_t unexplained =
                               e.unexplainedFalseShadowCount + e.unexplainedFalseLightCount,
                           settled = e.settledFalseShadowCount + e.settledFalseLightCount;
            const Base now{double(e.falseShadowCount + e.falseLightCount) / pairs,
                           e.meanAbsVisibilityError(), double(unexplained) / pairs,
                           double(unexplained - settled) / pairs, std::max(texels, 1.0)};
            if (p.kind == "unperturbed")
                bases.push_back(now);
            const Base& base = bases[size_t(m)];
            row.update({{"pair_count", e.pairCount},
                        {"false_shadow_count", e.falseShadowCount},
                        {"false_light_count", e.falseLightCount},
                        {"unexplained_count", unexplained},
                        {"settled_count", settled},
                        {"acne_count", e.acneCount},
                        {"contact_count", e.contactCount},
                        {"wrong_share", now.wrongShare},
                        {"mean_error", now.meanError},
                        {"unexplained_share", now.unexplained},
                        {"unnamed_share", now.unnamed},
                        {"wrong_share_unperturbed", base.wrongShare},
                        {"mean_error_unperturbed", base.meanError},
                        {"voxel_scene", voxel},
                        {"texel_scene", units.texel * base.texels / now.texels},
                        {"float_spacing_scene", spacing},
                        {"largest_face_texels", texels},
                        {"drawn_map_count", result.frame.counts.drawnMapCount},
                        {"traced_map_count", result.frame.counts.tracedMapCount},
                        {"least_served_count", std::min(result.frame.counts.drawnMapCount,
                                                        result.frame.counts.tracedMapCount)}});
            BandInputs inputs;
            inputs.count = pairs;
            addChecks(table, results["checks"], group.part, row, "least_served_count",
                      row["least_served_count"].get<double>(), inputs);
            if (p.kind != "unperturbed") {
                inputs.outlineCount = std::max(1, group.outlineCount);
                inputs.voxelSpacing = spacing / voxel;
                inputs.texelSpacing = spacing / units.texel;
                inputs.voxelRatio = voxel / units.voxel;
                inputs.texelRatio = base.texels / now.texels;
                inputs.reachTexels = 1.0 + std::sqrt(0.5) * (filterSide(taps) - 1);
                inputs.wrongShare = base.wrongShare;
                inputs.base = base.wrongShare;
                addChecks(table, results["checks"], group.part, row, "wrong_share", now.wrongShare,
                          inputs);
                inputs.base = base.meanError;
                addChecks(table, results["checks"], group.part, row, "mean_error", now.meanError,
                          inputs);
                inputs.base = base.unexplained;
                addChecks(table, results["checks"], group.part, row, "unexplained_share",
                          now.unexplained, inputs);
                inputs.base = base.unnamed;
                addChecks(table, results["checks"], group.part, row, "unnamed_share", now.unnamed,
                          inputs);
            }
            results["perturbation"].push_back(std::move(row));
        }
    }
}

} // namespace shadowdag
