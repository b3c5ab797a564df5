// SPDX-License-Identifier: Apache-2.0
#include "shadowmap/rasterize_gl.h"

#include <cstddef>

namespace shadowdag {

static_assert(offsetof(GlMap, layers) == 32 && offsetof(GlMap, u) == 64 &&
              offsetof(GlMap, w) == 128);

GlMap glMap(const ShadowMapInfo& map) {
    const SunWindow& s = map.window;
    GlMap gl{};
    gl.lightPositionWorld = map.lightPositionWorld;
    gl.rangeWorld = map.rangeWorld;
    gl.faceTexels = map.faceTexels;
    gl.facePages = map.facePages;
    gl.pageTableStart = map.pageTableStart;
    gl.isSun = s.isSun() ? 1u : 0u;
    gl.u = s.u;
    gl.u0 = s.u0;
    gl.v = s.v;
    gl.v0 = s.v0;
    gl.w = s.w;
    gl.w0 = s.w0;
    return gl;
}

GlDefines numericDefines(const GlInfo& info) {
    GlDefines defines;
    if (info.hasFusedMultiplyAdd)
        defines.emplace_back("SDAG_FUSED_MULTIPLY_ADD", "1");
    if (info.hasExactDivision)
        defines.emplace_back("SDAG_EXACT_DIVISION", "1");
    return defines;
}

GlDefines lookupDefines() {
    return {{"SDAG_MAPS_BINDING", std::to_string(GlMapDrawer::kMapsBinding)},
            {"SDAG_PAGE_TABLE_BINDING", std::to_string(GlMapDrawer::kPageTableBinding)},
            {"SDAG_DEPTHS_BINDING", std::to_string(GlMapDrawer::kDepthsBinding)}};
}

namespace {

GlDefines rasterizeDefines(const GlInfo& info) {
    GlDefines defines = numericDefines(info);
    for (const auto& define : lookupDefines())
        defines.push_back(define);
    return defines;
}

} // namespace

GlMapDrawer::GlMapDrawer(const GlContext& context, GlGeometry& geometry)
    : context_(context), geometry_(geometry),
      rasterize_("shadow map rasterization",
                 {{GlStage::kVertex, "shadowmap/rasterize.vert"},
                  {GlStage::kFragment, "shadowmap/rasterize.frag"}},
                 glGlsl() + scenesGlsl() + shadowmapGlsl(), rasterizeDefines(context.info())),
      clearPages_("page clear", {{GlStage::kCompute, "shadowmap/clear_pages.comp"}},
                  glGlsl() + shadowmapGlsl()) {}

void GlMapDrawer::makeRoom(uint64_t pageCount, uint32_t pageTexelsLog2, bool keeps) {
    pageTexelsLog2_ = pageTexelsLog2;
    depths_.resize((pageCount << (2 * pageTexelsLog2)) * sizeof(uint32_t), keeps);
}

void GlMapDrawer::clear(View<const uint32_t> freshEntries, View<const uint32_t> pageTable) {
    std::vector<uint32_t> pages;
    pages.reserve(freshEntries.count);
    for (const uint32_t entry : freshEntries)
        if (pageTable[entry] != kNoPage)
            pages.push_back(pageTable[entry]);
    pages_.upload(pages);
    pages_.bindStorage(0);
    depths_.bindStorage(kDepthsBinding);
    clearPages_.set("pageTexelsLog2", pageTexelsLog2_);
    clearPages_.set("pageCount", uint32_t(pages.size()));
    clearPages_.dispatch(pages.size());
    context_.finish("clearing pages");
}

void GlMapDrawer::draw(const RasterView& view, View<const uint32_t> pageTable) {
    std::vector<GlMap> maps;
    uint32_t widest = 1;
    for (const ShadowMapInfo& map : view.maps) {
        maps.push_back(glMap(map));
        widest = glm::max(widest, map.faceTexels);
    }
    if (int64_t(widest) > context_.info().maxViewport)
        throw Error(ErrorKind::kUsage, "a face of " + std::to_string(widest) +
                                           " texels, but this OpenGL draws " +
                                           std::to_string(context_.info().maxViewport) +
                                           " a side; lower the largest face resolution");
    maps_.upload(maps);
    pageTable_.upload(pageTable);
    openTable_.upload(view.pageTable);
    std::vector<GlCommand> commands;
    std::vector<glm::uvec2> targets;
    for (const BatchDraw& draw : view.draws) {
        const Batch& batch = view.batches[draw.batch];
        for (uint32_t face = 0; face < kFaceCount; ++face) {
            if (!(draw.faces >> face & 1u))
                continue;
            commands.push_back({3 * batch.count, 1, 3 * batch.first, uint32_t(targets.size())});
            targets.emplace_back(draw.map, face);
        }
    }
    if (commands.empty())
        return;
    commands_.set(commands);
    targets_.upload(targets);
    target_.bind(int(widest), int(widest));
    targets_.bindStorage(0);
    maps_.bindStorage(kMapsBinding);
    openTable_.bindStorage(kPageTableBinding);
    depths_.bindStorage(kDepthsBinding);
    geometry_.bind(rasterize_);
    rasterize_.set("viewportTexels", float(widest));
    rasterize_.set("pageTexelsLog2", pageTexelsLog2_);
    commands_.draw(rasterize_, 0, commands_.count());
    context_.finish("shadow map rasterization");
}

void GlMapDrawer::bindLookup(const GlProgram& program, const ShadowMapBias& bias) {
    maps_.bindStorage(kMapsBinding);
    pageTable_.bindStorage(kPageTableBinding);
    depths_.bindStorage(kDepthsBinding);
    program.set("pageTexelsLog2", pageTexelsLog2_);
    program.set("biasTexels", bias.constantTexels);
    program.set("filterTaps", bias.taps);
}

} // namespace shadowdag
