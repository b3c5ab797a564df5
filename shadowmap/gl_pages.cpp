// SPDX-License-Identifier: Apache-2.0
#include "shadowmap/gl_pages.h"

#include "cuda/error.h"

#include <atomic>

namespace shadowdag {

namespace {

std::atomic<GlPages> requestedPages{GlPages::kAuto};

// What the device lacks for sparse textures; empty: nothing.
std::string missingFor(const GlInfo& info) {
    if (!info.hasSparseTextures)
        return "no ARB_sparse_texture";
    if (info.sparsePageTexels < 16 || info.sparsePageTexels > 256)
        return "pages of sparse textures are not squares of 16 to 256 texels";
    return "";
}

} // namespace

void setGlPages(GlPages pages) {
    requestedPages = pages;
}

GlPages requestedGlPages() {
    return requestedPages;
}

GlPages chooseGlPages(GlPages asked, const GlInfo& info) {
    const std::string missing = missingFor(info);
    if (asked == GlPages::kSparse && !missing.empty())
        throw Error(ErrorKind::kDevice, "sparse pages are not supported: " + info.renderer +
                                            " has " + missing + "; use --gl-pages atlas");
    if (asked == GlPages::kDenseLayers)
        return asked;
    return asked == GlPages::kAtlas || !missing.empty() ? GlPages::kAtlas : GlPages::kSparse;
}

uint32_t glPageTexels(GlPages pages, const GlInfo& info) {
    return pages == GlPages::kSparse        ? info.sparsePageTexels
           : pages == GlPages::kDenseLayers ? kDensePageTexels
                                            : 0;
}

uint32_t requestedGlPageTexels() {
    const GlInfo& info = glDeviceInfo();
    return glPageTexels(chooseGlPages(requestedGlPages(), info), info);
}

bool drawsLayers(GlPages pages, const GlInfo& info) {
    return pages == GlPages::kSparse        ? info.drawsSparseLayers
           : pages == GlPages::kDenseLayers ? !info.layerExtension.empty()
                                            : false;
}

std::string describeGlPages(GlPages asked, const GlInfo& info) {
    const std::string side = std::to_string(info.sparsePageTexels);
    if (chooseGlPages(asked, info) == GlPages::kSparse)
        return info.renderer + ", pages of " + side + " x " + side +
               " texels committed by ARB_sparse_texture" +
               (info.drawsSparseLayers ? ", layers drawn into"
                                       : ", written by atomics (it draws layers of them wrongly)");
    if (asked == GlPages::kDenseLayers)
        return info.renderer + ", pages in fully allocated layers (as requested)";
    const std::string missing = missingFor(info);
    return info.renderer + ", pages in an atlas (" + (missing.empty() ? "as requested" : missing) +
           ")";
}

} // namespace shadowdag
