// SPDX-License-Identifier: Apache-2.0
#include "shadowmap/rasterize_gl.h"

#include "gl/slices.h"
#include "shadowmap/sparse_gl.h"

#include <cstddef>
#include <limits>

namespace shadowdag {

static_assert(int(GlMapDrawer::kMoreDepthsBinding) <
              kGlBindings); // the greatest of rasterize.frag's
static_assert(offsetof(GlMap, faceLayer) == 32 && offsetof(GlMap, u) == 64 &&
              offsetof(GlMap, w) == 128);

GlMap glMap(const ShadowMapInfo& map) {
    const DirectionalWindow& s = map.window;
    GlMap gl{};
    gl.lightPositionWorld = map.lightPositionWorld;
    gl.rangeWorld = map.rangeWorld;
    gl.faceTexels = map.faceTexels;
    gl.facePages = map.facePages;
    gl.pageTableStart = map.pageTableStart;
    gl.isDirectional = s.isDirectional() ? 1u : 0u;
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

uint64_t atlasChunkTexels(const GlInfo& info) {
    constexpr uint64_t kLargestPage = 256 * 256, kMost = uint64_t(1) << 31;
    return glm::min(info.maxStorageBytes / sizeof(uint32_t), kMost) / kLargestPage * kLargestPage;
}

GlDefines lookupDefines(GlPages pages, const GlInfo& info) {
    GlDefines defines{{"SDAG_MAPS_BINDING", std::to_string(GlMapDrawer::kMapsBinding)},
                      {"SDAG_PAGE_TABLE_BINDING", std::to_string(GlMapDrawer::kPageTableBinding)},
                      {"SDAG_DEPTHS_BINDING", std::to_string(GlMapDrawer::kDepthsBinding)},
                      {"SDAG_MORE_DEPTHS_BINDING", std::to_string(GlMapDrawer::kMoreDepthsBinding)},
                      {"SDAG_CHUNK_TEXELS", std::to_string(atlasChunkTexels(info)) + "u"}};
    if (pages != GlPages::kAtlas) {
        defines.emplace_back("SDAG_SPARSE_PAGES", "1");
        defines.emplace_back("SDAG_SPARSE_ARRAYS", std::to_string(kMaxSparseArrays));
    }
    if (drawsLayers(pages, info))
        defines.emplace_back("SDAG_LAYERED", "1");
    return defines;
}

namespace {

GlDefines rasterizeDefines(GlPages pages, const GlInfo& info) {
    GlDefines defines = numericDefines(info);
    for (const auto& define : lookupDefines(pages, info))
        defines.push_back(define);
    if (drawsLayers(pages, info))
        defines.emplace_back("extension", info.layerExtension);
    return defines;
}

} // namespace

std::unique_ptr<GlMapDrawer> GlMapDrawer::make(GlPages pages, const GlContext& context,
                                               GlGeometry& geometry) {
    if (pages != GlPages::kAtlas)
        return std::make_unique<GlSparseDrawer>(pages, context, geometry);
    return std::make_unique<GlAtlasDrawer>(context, geometry);
}

GlMapDrawer::GlMapDrawer(GlPages pages, const GlContext& context, GlGeometry& geometry)
    : context_(context), geometry_(geometry),
      rasterize_("shadow map rasterization",
                 {{GlStage::kVertex, "shadowmap/rasterize.vert"},
                  {GlStage::kFragment, "shadowmap/rasterize.frag"}},
                 glGlsl() + scenesGlsl() + shadowmapGlsl(),
                 rasterizeDefines(pages, context.info())) {}

void GlMapDrawer::setMaps(const std::vector<GlMap>& maps, View<const uint32_t> pageTable) {
    for (const GlMap& map : maps)
        if (int64_t(map.faceTexels) > context_.info().maxViewport)
            throw Error(ErrorKind::kUsage, "a face of " + std::to_string(map.faceTexels) +
                                               " texels, but this OpenGL draws " +
                                               std::to_string(context_.info().maxViewport) +
                                               " a side; lower the largest face resolution");
    maps_.upload(maps);
    pageTable_.upload(pageTable);
    commands_.set(listed_);
    targets_.upload(listedTargets_);
}

void GlMapDrawer::prepare(uint32_t viewportTexels) {
    targets_.bindStorage(0);
    maps_.bindStorage(kMapsBinding);
    geometry_.bind(rasterize_);
    rasterize_.set("viewportTexels", float(viewportTexels));
    rasterize_.set("pageTexelsLog2", pageTexelsLog2_);
}

void GlMapDrawer::drawCommands(uint32_t begin, uint32_t end) const {
    GlSlices slices(context_, end - begin, "shadow map rasterization");
    while (slices.next())
        commands_.draw(rasterize_, begin + uint32_t(slices.begin()),
                       begin + uint32_t(slices.end()));
}

void GlMapDrawer::warmUp() {
    // A light that is not finite: no triangle has an area as seen from it.
    GlMap nowhere{};
    nowhere.lightPositionWorld = glm::vec3(std::numeric_limits<float>::quiet_NaN());
    nowhere.faceTexels = nowhere.facePages = 1;
    listed_ = {{3, 1, 0, 0}};
    listedTargets_ = {{0, 0}};
    const std::vector<uint32_t> noPages(kFaceCount, kNoPage);
    setMaps({nowhere}, viewOf(noPages));
    prepare(1);
    pageTable_.bindStorage(kPageTableBinding);
    bindDepths(rasterize_);
    commands_.draw(rasterize_, 0, geometry_.hasTriangles() ? 1 : 0);
    context_.finish("preparing shadow maps");
}

void GlMapDrawer::bindLookup(const GlProgram& program, const ShadowMapBias& bias) {
    maps_.bindStorage(kMapsBinding);
    pageTable_.bindStorage(kPageTableBinding);
    bindDepths(program);
    program.set("pageTexelsLog2", pageTexelsLog2_);
    program.set("biasTexels", bias.constantTexels);
    program.set("filterTaps", bias.taps);
}

GlAtlasDrawer::GlAtlasDrawer(const GlContext& context, GlGeometry& geometry)
    : GlMapDrawer(GlPages::kAtlas, context, geometry),
      clearPages_("page clear", {{GlStage::kCompute, "shadowmap/clear_pages.comp"}},
                  glGlsl() + shadowmapGlsl(), lookupDefines(GlPages::kAtlas, context.info())) {}

void GlAtlasDrawer::bindDepths(const GlProgram&) {
    depths_.bindStorage(kDepthsBinding);
    moreDepths_.bindStorage(kMoreDepthsBinding);
}

std::vector<uint32_t> GlAtlasDrawer::downloadDepths() {
    std::vector<uint32_t> depths = depths_.download<uint32_t>();
    const std::vector<uint32_t> more = moreDepths_.download<uint32_t>();
    depths.insert(depths.end(), more.begin(), more.end());
    return depths;
}

void GlAtlasDrawer::makeRoom(uint64_t pageCount, uint32_t pageTexelsLog2, bool keeps) {
    pageTexelsLog2_ = pageTexelsLog2;
    const uint64_t texels = pageCount << (2 * pageTexelsLog2);
    const uint64_t first = glm::min(texels, atlasChunkTexels(context_.info()));
    depths_.resize(first * sizeof(uint32_t), keeps);
    moreDepths_.resize((texels - first) * sizeof(uint32_t), keeps);
}

void GlAtlasDrawer::clear(View<const uint32_t> freshEntries, View<const uint32_t> pageTable) {
    std::vector<uint32_t> pages;
    pages.reserve(freshEntries.count);
    for (const uint32_t entry : freshEntries)
        if (pageTable[entry] != kNoPage)
            pages.push_back(pageTable[entry]);
    pages_.upload(pages);
    pages_.bindStorage(0);
    bindDepths(clearPages_);
    clearPages_.set("pageTexelsLog2", pageTexelsLog2_);
    clearPages_.set("pageCount", uint32_t(pages.size()));
    clearPages_.dispatch(pages.size());
    context_.finish("clearing pages");
}

void GlAtlasDrawer::warmUp() {
    clear({}, {});
    bindDepths(clearPages_);
    clearPages_.set("pageCount", 0u);
    clearPages_.dispatch(1);
    target_.bind(1, 1);
    GlMapDrawer::warmUp();
}

void GlAtlasDrawer::draw(const RasterView& view, View<const uint32_t> pageTable) {
    std::vector<GlMap> maps;
    uint32_t widest = 1;
    for (const ShadowMapInfo& map : view.maps) {
        maps.push_back(glMap(map));
        widest = glm::max(widest, map.faceTexels);
    }
    listed_.clear();
    listedTargets_.clear();
    list(view, [](uint32_t, uint32_t) { return true; });
    setMaps(maps, pageTable);
    if (listed_.empty())
        return;
    openTable_.upload(view.pageTable);
    prepare(widest);
    target_.bind(int(widest), int(widest));
    openTable_.bindStorage(kPageTableBinding);
    bindDepths(rasterize_);
    drawCommands(0, commands_.count());
}

} // namespace shadowdag
