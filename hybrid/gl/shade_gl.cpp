// SPDX-License-Identifier: Apache-2.0
// The input of shading is uploaded as few, packed arrays (drivers bind 16 to a stage), in the order
// in which clusters list their samples; its output is copied to where the CPU would have written
// it.
#include "hybrid/gl/shade_gl.h"

#include "cuda/parallel_for.h"
#include "gl/slices.h"
#include "hybrid/gl/gbuffer_gl.h"
#include "hybrid/gl/movers_gl.h"
#include "voxel/dag_gl.h"

#include <algorithm>
#include <utility>

namespace shadowdag {

namespace {

/// In the format of shade.comp.
struct GlSample {
    glm::vec3 positionWorld;
    uint32_t triangle;
    glm::vec3 normalWorld;
    uint32_t material;
    uint32_t pixel, cluster, firstPair, endPair;
};
static_assert(sizeof(GlSample) == 48);
static_assert(sizeof(Light) == 60 && sizeof(SurfaceColor) == 24);

constexpr uint32_t kGroupSize = 64;
constexpr uint32_t kCountsPerCluster = 5;
constexpr uint32_t kDagBinding = 12, kPositionsBinding = 13, kTrianglesBinding = 14,
                   kMoversBinding = 15;
static_assert(int(kMoversBinding) < kGlBindings); // the greatest of shade.comp's
// Of a recorded pair's word, whose lower bits are those of its PairServer and its visibility.
constexpr uint32_t kAnswered = 1u << 31, kVisibilityBits = 8;

GlDefines shadeDefines(GlPages pages, const GlInfo& info) {
    GlDefines defines = numericDefines(info);
    for (const auto& define : lookupDefines(pages, info))
        defines.push_back(define);
    for (const auto& define : dagDefines(kDagBinding))
        defines.push_back(define);
    for (const auto& define : moverDefines(kPositionsBinding, kTrianglesBinding, kMoversBinding))
        defines.push_back(define);
    const auto add = [&](const char* name, uint32_t value) {
        defines.emplace_back(name, std::to_string(value) + "u");
    };
    defines.emplace_back("SDAG_GROUP_SIZE", std::to_string(kGroupSize));
    add("SDAG_COUNTS_PER_CLUSTER", kCountsPerCluster);
    add("SDAG_ANSWERED", kAnswered);
    add("SDAG_VISIBILITY_BITS", kVisibilityBits);
    add("SDAG_SERVED_BY_RAYS", uint32_t(ServedBy::kRays));
    add("SDAG_SERVED_BY_PROOF", uint32_t(ServedBy::kProof));
    add("SDAG_SERVER_METHOD_BITS", PairServer::kMethodBits);
    return defines;
}

} // namespace

GlShading::GlShading(GlPages pages, const GlContext& context, GlGeometry& geometry)
    : context_(context),
      program_("shading", {{GlStage::kCompute, "hybrid/gl/shade.comp"}},
               glGlsl() + scenesGlsl() + voxelGlsl() + shadowmapGlsl() + hybridGlsl(),
               shadeDefines(pages, context.info())),
      geometry_(geometry) {}

void GlShading::setDag(const DagView& dag) {
    dag_.upload(dag.words);
    dagRootAddress_ = dag.rootAddress;
    grid_ = dag.grid;
}

void GlShading::upload(const ShadeSamples& work, View<const uint32_t> pairLights) {
    const bool isRecording = !work.recorder.nextPair.empty();
    std::vector<GlSample> samples(work.clusters.samples.count);
    // With base colour textures every sample has a material of its own.
    const bool hasTextures = !work.gbuffer.baseColor.empty();
    std::vector<SurfaceColor> surfaces(hasTextures ? samples.size() : 0);
    parallelFor<CpuTag>(
        samples.size(),
        [&](size_t i) {
            const uint32_t pixel = work.clusters.samples[i];
            const uint32_t triangle = work.gbuffer.triangle[pixel];
            GlSample& s = samples[i];
            s = {work.gbuffer.positionWorld[pixel],
                 triangle,
                 work.gbuffer.normalWorld[pixel],
                 hasTextures ? uint32_t(i) : work.triangleMaterial[triangle],
                 pixel,
                 work.clusters.clusterOfSample[pixel],
                 0,
                 0};
            if (hasTextures)
                surfaces[i] = work.surfaceOf(pixel);
            if (isRecording) {
                s.firstPair = work.recorder.nextPair[pixel];
                s.endPair = work.recorder.nextPair[pixel + 1];
            }
        },
        4096);
    samples_.upload(samples);
    lights_.upload(work.lights);
    surfaces_.upload(hasTextures ? viewOf(std::as_const(surfaces)) : work.materials);
    clusterStarts_.upload(work.lists.start);
    std::vector<glm::uvec2> entries(work.lists.lights.count);
    for (size_t l = 0; l < entries.size(); ++l)
        entries[l] = {work.lists.lights[l], work.serverOf(uint32_t(l)).word};
    clusterLights_.upload(entries);
    colors_.resize(work.color.count * sizeof(glm::vec3));
    colors_.fill(0);
    counts_.resize(work.clusters.count() * kCountsPerCluster * sizeof(uint32_t));
    counts_.fill(0);
    pairs_.upload(isRecording ? pairLights : View<const uint32_t>{});
    movers_.upload(packMovers(work.visibility.rays.movers));
}

void GlShading::download(const ShadeSamples& work) {
    colors_.read(work.color.data, work.color.count * sizeof(glm::vec3));
    const std::vector<uint32_t> counts = counts_.download<uint32_t>();
    const View<uint32_t> sums[kCountsPerCluster] = {work.rayCount, work.lookupCount,
                                                    work.provenCount, work.missingTapCount,
                                                    work.moverTestCount};
    for (size_t cluster = 0; cluster < work.clusters.count(); ++cluster)
        for (uint32_t i = 0; i < kCountsPerCluster; ++i)
            sums[i][cluster] += counts[cluster * kCountsPerCluster + i];
    if (work.recorder.nextPair.empty())
        return;
    const std::vector<uint32_t> answers = pairs_.download<uint32_t>();
    const size_t unanswered = size_t(std::count_if(
        answers.begin(), answers.end(), [](uint32_t answer) { return !(answer & kAnswered); }));
    if (unanswered)
        throw Error(ErrorKind::kDevice,
                    "OpenGL computed all but " + std::to_string(unanswered) + " of " +
                        std::to_string(answers.size()) +
                        " recorded pairs: their lights are not in the order of their clusters' "
                        "lists, or this driver's compute shaders fail; use --backend cpu, and "
                        "report this driver");
    parallelFor<CpuTag>(
        answers.size(),
        [&](size_t pair) {
            const uint32_t answer = answers[pair] & ~kAnswered;
            work.recorder.visibility[pair] = uint8_t(answer & ((1u << kVisibilityBits) - 1));
            work.recorder.server[pair].word = answer >> kVisibilityBits;
        },
        65536);
    // All of them: each sample's next pair is the first of the sample behind it.
    uint32_t* const next = work.recorder.nextPair.data;
    std::copy(next + 1, next + work.recorder.nextPair.count, next);
}

void GlShading::bindBuffers() {
    samples_.bindStorage(0);
    lights_.bindStorage(2);
    surfaces_.bindStorage(3);
    clusterStarts_.bindStorage(4);
    clusterLights_.bindStorage(7);
    colors_.bindStorage(8);
    counts_.bindStorage(9);
    pairs_.bindStorage(10);
    dag_.bindStorage(kDagBinding);
    geometry_.bindCorners(kPositionsBinding, kTrianglesBinding);
    movers_.bindStorage(kMoversBinding);
}

void GlShading::warmUp(GlMapDrawer& maps) {
    bindBuffers();
    maps.bindLookup(program_, {});
    program_.set("sampleCount", 0u);
    program_.dispatch(1);
    context_.finish("preparing shading");
}

void GlShading::shade(const ShadeSamples& work, GlMapDrawer& maps,
                      View<const uint32_t> pairLights) {
    upload(work, pairLights);
    bindBuffers();
    const MoverView& movers = work.visibility.rays.movers;
    program_.set("hasMovers", uint32_t(movers_.bytes() != 0));
    program_.set("truthOrigin", movers.geometry.origin);
    program_.set("truthDiagonal", movers.geometry.diagonal);
    maps.bindLookup(program_, work.visibility.bias);
    program_.set("dagRootAddress", dagRootAddress_);
    program_.set("dagResolutionLog2", grid_.resolutionLog2);
    program_.set("gridOrigin", grid_.originWorld);
    program_.set("voxelSize", grid_.voxelSizeWorld);
    program_.set("rayOffset", work.visibility.rays.options.offset);
    program_.set("sampleCount", uint32_t(work.clusters.samples.count));
    program_.set("isRecording", uint32_t(!work.recorder.nextPair.empty()));
    GlSlices slices(context_, (work.clusters.samples.count + kGroupSize - 1) / kGroupSize,
                    "shading");
    while (slices.next())
        program_.dispatch(slices.end() - slices.begin(), slices.begin());
    download(work);
}

} // namespace shadowdag
