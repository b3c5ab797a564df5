// SPDX-License-Identifier: Apache-2.0
#include "shadowmap/sparse_gl.h"

#include <algorithm>
#include <bit>
#include <map>

namespace shadowdag {

namespace {

constexpr uint32_t kMostLayers = 2048; // what OpenGL 4.5 promises
// Mesa 25.0's zink takes the very first page of a texture from it when it takes others (seen in
// tests/gl): nobody stands there. It costs addresses, no memory.
constexpr uint32_t kFirstLayer = 1;
constexpr uint32_t kLeastLayers = 4; // kMaxArrayBytes holds as many of the largest faces

/// Calls run(layer, x, y, count) for the runs of pages, along rows, of which isIn(index) holds.
template <class IsIn, class Run>
void forRuns(uint32_t layers, uint32_t pages, const IsIn& isIn, const Run& run) {
    size_t index = 0;
    for (uint32_t layer = 0; layer < layers; ++layer)
        for (uint32_t y = 0; y < pages; ++y) {
            for (uint32_t x = 0; x < pages;) {
                uint32_t end = x;
                while (end < pages && isIn(index + end))
                    ++end;
                if (end > x)
                    run(layer, x, y, end - x);
                x = end + 1;
            }
            index += pages;
        }
}

bool isLayered(const GlContext& context, GlSparseArray::Memory memory) {
    return memory == GlSparseArray::kDense ? !context.info().layerExtension.empty()
                                           : context.info().drawsSparseLayers;
}

} // namespace

GlSparseDrawer::GlSparseDrawer(const GlContext& context, GlGeometry& geometry,
                               GlSparseArray::Memory memory)
    : GlMapDrawer(GlPages::kSparse, isLayered(context, memory), context, geometry), memory_(memory),
      isLayered_(isLayered(context, memory)),
      gather_("page gathering", {{GlStage::kCompute, "shadowmap/gather_pages.comp"}},
              glGlsl() + shadowmapGlsl(),
              lookupDefines(GlPages::kSparse, isLayered_, context.info())),
      clearPages_("page clear", {{GlStage::kCompute, "shadowmap/clear_sparse.comp"}},
                  glGlsl() + shadowmapGlsl(),
                  lookupDefines(GlPages::kSparse, isLayered_, context.info())) {}

uint32_t GlSparseDrawer::Array::pagesPerSide() const {
    return side / pageTexels;
}

size_t GlSparseDrawer::pageIndex(const Array& array, uint32_t layer, uint32_t x, uint32_t y) const {
    const size_t pages = array.pagesPerSide();
    return (size_t(layer) * pages + y) * pages + x;
}

void GlSparseDrawer::makeRoom(uint64_t pageCount, uint32_t pageTexelsLog2, bool keeps) {
    SDAG_ASSERT(
        1u << pageTexelsLog2 ==
        (memory_ == GlSparseArray::kDense ? kDensePageTexels : context_.info().sparsePageTexels));
    pageTexelsLog2_ = pageTexelsLog2;
    if (!keeps)
        place_.clear();
    place_.resize(pageCount, {0, kNoPage, 0, 0, 0});
}

uint32_t GlSparseDrawer::sideOf(uint32_t faceTexels) const {
    return std::bit_ceil(glm::max(faceTexels, 1u << pageTexelsLog2_));
}

GlSparseDrawer::Layer GlSparseDrawer::takeLayer(uint32_t side, uint32_t wantedCount) {
    const uint32_t pageTexels = 1u << pageTexelsLog2_;
    for (uint32_t a = 0; a < arrays_.size(); ++a) {
        if (arrays_[a].side != side)
            continue;
        std::vector<uint8_t>& isUsed = arrays_[a].isUsed;
        for (uint32_t layer = 0; layer < isUsed.size(); ++layer)
            if (!isUsed[layer]) {
                isUsed[layer] = 1;
                return {a, layer};
            }
    }
    if (arrays_.size() == kMaxSparseArrays)
        throw Error(ErrorKind::kResource,
                    "the faces of this frame's shadow maps need more than " +
                        std::to_string(kMaxSparseArrays) +
                        " sparse textures; keep pages in an atlas, or lower the largest face "
                        "resolution");
    const uint64_t layerBytes = uint64_t(side) * side * sizeof(float);
    const uint32_t most = uint32_t(glm::min(uint64_t(kMostLayers), kMaxArrayBytes / layerBytes));
    const uint32_t layers =
        glm::clamp(kFirstLayer + wantedCount + wantedCount / 2, kLeastLayers, most);
    Array array;
    array.side = side;
    array.pageTexels = pageTexels;
    array.texture = std::make_unique<GlSparseArray>(
        side, layers, pageTexels, isLayered_ ? GlSparseArray::kFloat : GlSparseArray::kBits,
        memory_);
    array.isUsed.assign(layers, 0);
    std::fill_n(array.isUsed.begin(), kFirstLayer, uint8_t(1));
    const size_t pages = size_t(layers) * array.pagesPerSide() * array.pagesPerSide();
    array.isCommitted.assign(pages, 0);
    array.isNeeded.assign(pages, 0);
    array.isUsed[kFirstLayer] = 1;
    arrays_.push_back(std::move(array));
    return {uint32_t(arrays_.size() - 1), kFirstLayer};
}

bool GlSparseDrawer::commit(View<const ShadowMapInfo> maps, View<const uint32_t> freshEntries,
                            View<const uint32_t> pageTable, PageCommits& commits) {
    for (const uint32_t entry : freshEntries)
        if (pageTable[entry] != kNoPage)
            place_[pageTable[entry]].array = kNoPage; // another page's texels, or none
    for (Array& array : arrays_) {
        std::fill(array.isUsed.begin() + kFirstLayer, array.isUsed.end(), uint8_t(0));
        std::fill(array.isNeeded.begin(), array.isNeeded.end(), uint8_t(0));
    }
    // First the layers of faces with kept pages, then layers for the others.
    std::vector<Layer> layers(maps.count * kFaceCount, {kNoPage, 0});
    const auto forPages = [&](uint32_t m, uint32_t face, const auto& page) {
        const ShadowMapInfo& map = maps[m];
        for (uint32_t y = 0; y < map.facePages; ++y)
            for (uint32_t x = 0; x < map.facePages; ++x)
                if (const uint32_t p = pageTable[pageTableIndex(map, face, x, y)]; p != kNoPage)
                    page(p, x, y);
    };
    for (uint32_t m = 0; m < maps.count; ++m)
        for (uint32_t face = 0; face < kFaceCount; ++face)
            forPages(m, face, [&](uint32_t p, uint32_t, uint32_t) {
                if (place_[p].array == kNoPage)
                    return;
                layers[m * kFaceCount + face] = {place_[p].array, place_[p].layer};
                arrays_[place_[p].array].isUsed[place_[p].layer] = 1;
            });
    std::map<uint32_t, uint32_t> wanted; // faces without a layer, by side
    for (uint32_t m = 0; m < maps.count; ++m)
        for (uint32_t face = 0; face < kFaceCount; ++face)
            if (layers[m * kFaceCount + face].array == kNoPage) {
                bool hasPages = false;
                forPages(m, face, [&](uint32_t, uint32_t, uint32_t) { hasPages = true; });
                wanted[sideOf(maps[m].faceTexels)] += hasPages;
            }
    drawn_.clear();
    for (uint32_t m = 0; m < maps.count; ++m) {
        drawn_.push_back(glMap(maps[m]));
        for (uint32_t face = 0; face < kFaceCount; ++face) {
            Layer& layer = layers[m * kFaceCount + face];
            forPages(m, face, [&](uint32_t p, uint32_t x, uint32_t y) {
                if (layer.array == kNoPage) {
                    const uint32_t side = sideOf(maps[m].faceTexels);
                    layer = takeLayer(side, wanted[side]--);
                }
                place_[p] = {p, layer.array, layer.layer, x, y};
                Array& array = arrays_[layer.array];
                array.isNeeded[pageIndex(array, layer.layer, x, y)] = 1;
            });
            drawn_[m].faceLayer[face] =
                layer.array == kNoPage ? kNoPage : layer.array << 16 | layer.layer;
        }
    }
    commitNeeded(commits);
    context_.finish("committing pages");
    return true;
}

void GlSparseDrawer::commitNeeded(PageCommits& commits) {
    for (Array& array : arrays_) {
        const uint32_t layers = uint32_t(array.isUsed.size()), pages = array.pagesPerSide();
        const auto change = [&](bool isCommitted, uint64_t& count) {
            forRuns(
                layers, pages,
                [&](size_t i) {
                    return array.isNeeded[i] == uint8_t(isCommitted) &&
                           array.isCommitted[i] != uint8_t(isCommitted);
                },
                [&](uint32_t layer, uint32_t x, uint32_t y, uint32_t run) {
                    array.texture->commit(layer, x, y, run, isCommitted);
                    count += run;
                });
        };
        change(false, commits.freedCount); // first, so that memory is there for the others
        change(true, commits.committedCount);
        array.isCommitted = array.isNeeded;
    }
}

void GlSparseDrawer::clear(View<const uint32_t> freshEntries, View<const uint32_t> pageTable) {
    std::vector<Place> places;
    for (const uint32_t entry : freshEntries)
        if (pageTable[entry] != kNoPage)
            places.push_back(place_[pageTable[entry]]);
    std::stable_sort(places.begin(), places.end(),
                     [](const Place& a, const Place& b) { return a.array < b.array; });
    places_.upload(places);
    places_.bindStorage(0);
    clearPages_.set("pageTexelsLog2", pageTexelsLog2_);
    for (size_t begin = 0, end; begin < places.size(); begin = end) {
        for (end = begin; end < places.size() && places[end].array == places[begin].array;)
            ++end;
        arrays_[places[begin].array].texture->bindImage();
        clearPages_.set("firstPage", uint32_t(begin));
        clearPages_.set("endPage", uint32_t(end));
        clearPages_.dispatch(end - begin);
    }
    context_.finish("clearing pages");
}

void GlSparseDrawer::draw(const RasterView& view, View<const uint32_t> pageTable) {
    std::vector<uint32_t> firstOfArray;
    listed_.clear();
    listedTargets_.clear();
    drawn_.resize(view.maps.count); // what is kept for nobody is not looked up
    for (uint32_t a = 0; a < arrays_.size(); ++a) {
        firstOfArray.push_back(uint32_t(listed_.size()));
        list(view,
             [&](uint32_t map, uint32_t face) { return drawn_[map].faceLayer[face] >> 16 == a; });
    }
    firstOfArray.push_back(uint32_t(listed_.size()));
    setMaps(drawn_, pageTable);
    for (uint32_t a = 0; a < arrays_.size() && !listed_.empty(); ++a) {
        prepare(arrays_[a].side);
        if (isLayered_) {
            arrays_[a].texture->bindTarget();
        } else {
            target_.bind(int(arrays_[a].side), int(arrays_[a].side));
            arrays_[a].texture->bindImage();
        }
        commands_.draw(rasterize_, firstOfArray[a], firstOfArray[a + 1]);
    }
    context_.finish("shadow map rasterization");
}

void GlSparseDrawer::bindDepths(const GlProgram& program) {
    for (uint32_t a = 0; a < kMaxSparseArrays; ++a) {
        program.setSampler(("sparseMaps[" + std::to_string(a) + "]").c_str(), int(a));
        if (a < arrays_.size())
            arrays_[a].texture->bindTexture(a);
    }
}

std::vector<uint32_t> GlSparseDrawer::downloadDepths() {
    std::vector<Place> places;
    for (const Place& place : place_)
        if (place.array != kNoPage)
            places.push_back(place);
    depths_.resize((uint64_t(place_.size()) << (2 * pageTexelsLog2_)) * sizeof(uint32_t));
    depths_.fill(0);
    places_.upload(places);
    places_.bindStorage(0);
    depths_.bindStorage(kDepthsBinding);
    bindDepths(gather_);
    gather_.set("pageTexelsLog2", pageTexelsLog2_);
    gather_.set("pageCount", uint32_t(places.size()));
    gather_.dispatch(places.size());
    context_.finish("gathering pages");
    return depths_.download<uint32_t>();
}

} // namespace shadowdag
