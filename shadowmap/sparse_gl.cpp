// SPDX-License-Identifier: Apache-2.0
#include "shadowmap/sparse_gl.h"

#include <algorithm>
#include <bit>

namespace shadowdag {

namespace {

constexpr uint32_t kMostLayers = 2048; // what OpenGL 4.5 promises
// Mesa 25.0's zink frees the very first page of a texture when it frees others (seen in tests/gl),
// so no face uses it. This costs addresses, no memory.
constexpr uint32_t kFirstLayer = 1;
// Number of pages that are copied at once: shaders can access 128 MiB of a buffer at least.
constexpr uint64_t kGatheredBytes = uint64_t(64) << 20;
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

/// Returns whether a layer is used. @param isUsed by layer
bool isAnyUsed(const std::vector<uint8_t>& isUsed) {
    return std::find(isUsed.begin() + kFirstLayer, isUsed.end(), uint8_t(1)) != isUsed.end();
}

} // namespace

GlSparseDrawer::GlSparseDrawer(GlPages pages, const GlContext& context, GlGeometry& geometry)
    : GlMapDrawer(pages, context, geometry), pages_(pages),
      isLayered_(drawsLayers(pages, context.info())),
      gather_("page gathering", {{GlStage::kCompute, "shadowmap/gather_pages.comp"}},
              glGlsl() + shadowmapGlsl(), lookupDefines(pages, context.info())),
      clearPages_("page clear", {{GlStage::kCompute, "shadowmap/clear_sparse.comp"}},
                  glGlsl() + shadowmapGlsl(), lookupDefines(pages, context.info())) {}

uint32_t GlSparseDrawer::Array::pagesPerSide() const {
    return side / pageTexels;
}

size_t GlSparseDrawer::pageIndex(const Array& array, uint32_t layer, uint32_t x, uint32_t y) const {
    const size_t pages = array.pagesPerSide();
    return (size_t(layer) * pages + y) * pages + x;
}

void GlSparseDrawer::makeRoom(uint64_t pageCount, uint32_t pageTexelsLog2, bool keeps) {
    SDAG_ASSERT(1u << pageTexelsLog2 == glPageTexels(pages_, context_.info()));
    pageTexelsLog2_ = pageTexelsLog2;
    if (!keeps)
        place_.clear();
    place_.resize(pageCount, {0, kNoPage, 0, 0, 0});
}

uint32_t GlSparseDrawer::sideOf(uint32_t faceTexels) const {
    return std::bit_ceil(glm::max(faceTexels, 1u << pageTexelsLog2_));
}

uint32_t GlSparseDrawer::mostLayers(uint32_t side) const {
    return uint32_t(
        glm::min(uint64_t(kMostLayers), kMaxArrayBytes / (uint64_t(side) * side * sizeof(float))));
}

GlSparseDrawer::Array GlSparseDrawer::makeArray(uint32_t side, uint32_t layers) const {
    Array array;
    array.side = side;
    array.pageTexels = 1u << pageTexelsLog2_;
    array.texture = std::make_unique<GlSparseArray>(
        side, layers, array.pageTexels, isLayered_ ? GlSparseArray::kFloat : GlSparseArray::kBits,
        pages_ == GlPages::kSparse ? GlSparseArray::kSparse : GlSparseArray::kDense);
    array.isUsed.assign(layers, 0);
    std::fill_n(array.isUsed.begin(), kFirstLayer, uint8_t(1));
    const size_t pages = size_t(layers) * array.pagesPerSide() * array.pagesPerSide();
    array.isCommitted.assign(pages, 0);
    array.isNeeded.assign(pages, 0);
    return array;
}

void GlSparseDrawer::drop(uint32_t a, PageCommits& commits) {
    const std::vector<uint8_t>& had = arrays_[a].isCommitted;
    commits.freedCount += uint64_t(std::count(had.begin(), had.end(), uint8_t(1)));
    arrays_.erase(arrays_.begin() + a);
    for (Place& place : place_)
        if (place.array != kNoPage && place.array > a)
            --place.array;
}

void GlSparseDrawer::dropIdle(const std::map<uint32_t, uint32_t>& wanted, PageCommits& commits) {
    for (uint32_t a = uint32_t(arrays_.size()); a-- > 0;) {
        Array& array = arrays_[a];
        const auto found = wanted.find(array.side);
        const bool isIdle = !isAnyUsed(array.isUsed) && (found == wanted.end() || !found->second);
        array.idleBuilds = isIdle ? array.idleBuilds + 1 : 0;
        if (array.idleBuilds >= kIdleBuilds)
            drop(a, commits);
    }
}

void GlSparseDrawer::grow(uint32_t a, uint32_t layers, PageCommits& commits) {
    Array &old = arrays_[a], grown = makeArray(old.side, layers);
    for (const Place& place : place_)
        if (place.array == a)
            grown.isCommitted[pageIndex(old, place.layer, place.x, place.y)] = 1;
    uint64_t movedCount = 0; // no page more or less by that
    forRuns(
        old.layerCount(), old.pagesPerSide(), [&](size_t i) { return grown.isCommitted[i] != 0; },
        [&](uint32_t layer, uint32_t x, uint32_t y, uint32_t run) {
            grown.texture->commit(layer, x, y, run, true);
            grown.texture->copyPages(*old.texture, layer, x, y, run);
            movedCount += run;
        });
    commits.freedCount +=
        uint64_t(std::count(old.isCommitted.begin(), old.isCommitted.end(), uint8_t(1))) -
        movedCount;
    std::copy(old.isUsed.begin(), old.isUsed.end(), grown.isUsed.begin());
    context_.finish("moving pages to a larger texture");
    old = std::move(grown);
}

void GlSparseDrawer::reserve(uint32_t side, uint32_t wantedCount,
                             const std::map<uint32_t, uint32_t>& wanted, PageCommits& commits) {
    const uint32_t most = mostLayers(side);
    for (;;) {
        uint32_t freeCount = 0, growing = kNoPage;
        for (uint32_t a = 0; a < arrays_.size(); ++a)
            if (arrays_[a].side == side) {
                const std::vector<uint8_t>& isUsed = arrays_[a].isUsed;
                freeCount += uint32_t(std::count(isUsed.begin(), isUsed.end(), uint8_t(0)));
                growing = arrays_[a].layerCount() < most ? a : growing;
            }
        if (freeCount >= wantedCount)
            return;
        const uint32_t missing = wantedCount - freeCount;
        if (growing != kNoPage) {
            const uint32_t has = arrays_[growing].layerCount();
            grow(growing, glm::min(has + glm::max(missing, has / 2), most), commits);
            continue;
        }
        for (uint32_t a = uint32_t(arrays_.size()); arrays_.size() == kMaxSparseArrays && a-- > 0;)
            if (!isAnyUsed(arrays_[a].isUsed) && !wanted.contains(arrays_[a].side))
                drop(a, commits);
        if (arrays_.size() == kMaxSparseArrays)
            throw Error(ErrorKind::kResource,
                        "the faces of this frame's shadow maps need more than " +
                            std::to_string(kMaxSparseArrays) +
                            " sparse textures; keep pages in an atlas, or lower the largest face "
                            "resolution");
        arrays_.push_back(
            makeArray(side, glm::clamp(kFirstLayer + missing + missing / 2, kLeastLayers, most)));
    }
}

GlSparseDrawer::Layer GlSparseDrawer::takeLayer(uint32_t side) {
    for (uint32_t a = 0; a < arrays_.size(); ++a) {
        if (arrays_[a].side != side)
            continue;
        std::vector<uint8_t>& isUsed = arrays_[a].isUsed;
        const auto found = std::find(isUsed.begin(), isUsed.end(), uint8_t(0));
        if (found == isUsed.end())
            continue;
        *found = 1;
        return {a, uint32_t(found - isUsed.begin())};
    }
    SDAG_ASSERT(false); // reserve() was called for as many
    return {kNoPage, 0};
}

namespace {

/// Calls page(p, x, y) for the pages of a face that are in the pool.
template <class Page>
void forPages(const ShadowMapInfo& map, uint32_t face, View<const uint32_t> pageTable,
              const Page& page) {
    for (uint32_t y = 0; y < map.facePages; ++y)
        for (uint32_t x = 0; x < map.facePages; ++x)
            if (const uint32_t p = pageTable[pageTableIndex(map, face, x, y)]; p != kNoPage)
                page(p, x, y);
}

} // namespace

void GlSparseDrawer::keepPlaces(View<const ShadowMapInfo> maps, View<const uint32_t> freshEntries,
                                View<const uint32_t> pageTable) {
    for (const uint32_t entry : freshEntries)
        if (pageTable[entry] != kNoPage)
            place_[pageTable[entry]].array = kNoPage; // another page's texels, or none
    std::vector<Place> kept(place_.size(), {0, kNoPage, 0, 0, 0});
    for (const ShadowMapInfo& map : maps)
        for (uint32_t face = 0; face < kFaceCount; ++face)
            forPages(map, face, pageTable,
                     [&](uint32_t p, uint32_t, uint32_t) { kept[p] = place_[p]; });
    place_ = std::move(kept); // pages that are in no table have lost their memory
    for (Array& array : arrays_) {
        std::fill(array.isUsed.begin() + kFirstLayer, array.isUsed.end(), uint8_t(0));
        std::fill(array.isNeeded.begin(), array.isNeeded.end(), uint8_t(0));
    }
    for (const Place& place : place_)
        if (place.array != kNoPage)
            arrays_[place.array].isUsed[place.layer] = 1;
}

bool GlSparseDrawer::commit(View<const ShadowMapInfo> maps, View<const uint32_t> freshEntries,
                            View<const uint32_t> pageTable, PageCommits& commits) {
    try {
        placeAndCommit(maps, freshEntries, pageTable, commits);
        context_.finish("committing pages");
    } catch (...) {
        // The committed pages are unknown now, and draws into pages wrongly taken for committed
        // would be lost.
        arrays_.clear();
        place_.clear();
        drawn_.clear();
        throw;
    }
    return true;
}

void GlSparseDrawer::placeAndCommit(View<const ShadowMapInfo> maps,
                                    View<const uint32_t> freshEntries,
                                    View<const uint32_t> pageTable, PageCommits& commits) {
    keepPlaces(maps, freshEntries, pageTable);
    std::map<uint32_t, uint32_t> wanted; // faces without a layer, by side
    for (const ShadowMapInfo& map : maps)
        for (uint32_t face = 0; face < kFaceCount; ++face) {
            bool hasPages = false, isKept = false;
            forPages(map, face, pageTable, [&](uint32_t p, uint32_t, uint32_t) {
                hasPages = true;
                isKept |= place_[p].array != kNoPage;
            });
            if (hasPages && !isKept)
                ++wanted[sideOf(map.faceTexels)];
        }
    dropIdle(wanted, commits);
    for (const auto& [side, count] : wanted)
        reserve(side, count, wanted, commits);
    // The layers of faces with kept pages, then new ones for the others.
    drawn_.clear();
    for (const ShadowMapInfo& map : maps) {
        drawn_.push_back(glMap(map));
        for (uint32_t face = 0; face < kFaceCount; ++face) {
            Layer layer{kNoPage, 0};
            forPages(map, face, pageTable, [&](uint32_t p, uint32_t, uint32_t) {
                if (place_[p].array != kNoPage)
                    layer = {place_[p].array, place_[p].layer};
            });
            forPages(map, face, pageTable, [&](uint32_t p, uint32_t x, uint32_t y) {
                if (layer.array == kNoPage)
                    layer = takeLayer(sideOf(map.faceTexels));
                place_[p] = {p, layer.array, layer.layer, x, y};
                Array& array = arrays_[layer.array];
                array.isNeeded[pageIndex(array, layer.layer, x, y)] = 1;
            });
            drawn_.back().faceLayer[face] =
                layer.array == kNoPage ? kNoPage : layer.array << 16 | layer.layer;
        }
    }
    commitNeeded(commits);
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
        change(false, commits.freedCount); // first, so that their memory is free for the others
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
    drawn_.resize(view.maps.count); // pages that are kept without a request are not looked up
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
        drawCommands(firstOfArray[a], firstOfArray[a + 1]);
    }
    context_.finish("shadow map rasterization");
}

void GlSparseDrawer::warmUp() {
    const uint32_t side = glPageTexels(pages_, context_.info());
    pageTexelsLog2_ = uint32_t(std::countr_zero(side));
    const Array array = makeArray(side, kLeastLayers);
    array.texture->bindImage();
    clear({}, {});
    clearPages_.set("endPage", 0u);
    clearPages_.dispatch(1);
    if (isLayered_)
        array.texture->bindTarget();
    else
        target_.bind(int(side), int(side));
    GlMapDrawer::warmUp();
}

void GlSparseDrawer::bindDepths(const GlProgram& program) {
    for (uint32_t a = 0; a < kMaxSparseArrays; ++a) {
        program.setSampler(("sparseMaps[" + std::to_string(a) + "]").c_str(), int(a));
        if (a < arrays_.size())
            arrays_[a].texture->bindTexture(a);
    }
}

std::vector<uint32_t> GlSparseDrawer::downloadDepths() {
    const uint64_t texels = uint64_t(1) << (2 * pageTexelsLog2_);
    const uint64_t most = glm::max(kGatheredBytes / (texels * sizeof(uint32_t)), uint64_t(1));
    std::vector<uint32_t> depths(place_.size() * texels);
    bindDepths(gather_);
    gather_.set("pageTexelsLog2", pageTexelsLog2_);
    for (uint64_t first = 0; first < place_.size(); first += most) {
        const uint64_t end = glm::min(first + most, uint64_t(place_.size()));
        std::vector<Place> places;
        for (uint64_t p = first; p < end; ++p)
            if (place_[p].array != kNoPage)
                places.push_back(place_[p]);
        depths_.resize((end - first) * texels * sizeof(uint32_t));
        depths_.fill(0);
        places_.upload(places);
        places_.bindStorage(0);
        depths_.bindStorage(kDepthsBinding);
        gather_.set("firstPool", uint32_t(first));
        gather_.set("pageCount", uint32_t(places.size()));
        gather_.dispatch(places.size());
        context_.finish("gathering pages");
        depths_.read(depths.data() + first * texels, depths_.bytes());
    }
    return depths;
}

} // namespace shadowdag
