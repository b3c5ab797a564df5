// SPDX-License-Identifier: Apache-2.0
// Where the pages of shadow maps in OpenGL have their memory.
#pragma once

#include "gl/context.h"

#include <string>

namespace shadowdag {

enum class GlPages {
    kAuto,   ///< sparse where there is ARB_sparse_texture, else an atlas
    kSparse, ///< layers of sparse textures, pages committed by the driver (the paper)
    kAtlas,  ///< one pool, pages found by the page table
    /// Layers as kSparse has them, with all their memory from the beginning: what tests ask for
    /// where there is no ARB_sparse_texture.
    kDenseLayers,
};

/// Side of a page in dense layers, texels.
constexpr uint32_t kDensePageTexels = 128;

/// Sets what renderers that are created later use, for the whole process; initially kAuto.
void setGlPages(GlPages pages);
/// Returns what was asked for last.
GlPages askedGlPages();

/// Returns what `asked` resolves to on a device, never kAuto. Throws Error kDevice for kSparse
/// where there are no sparse textures with square pages.
GlPages chooseGlPages(GlPages asked, const GlInfo& info);

/// Returns the side of the pages that a device has: of `pages`, which is not kAuto; 0: any side.
uint32_t glPageTexels(GlPages pages, const GlInfo& info);
/// Returns the same for what was asked for last, on the device that this process has. Throws Error
/// kDevice as chooseGlPages and glDeviceInfo do.
uint32_t askedGlPageTexels();

/// Returns whether maps are layers that the device draws into, which hold floats; else fragments
/// write them by atomics. @param pages not kAuto
bool drawsLayers(GlPages pages, const GlInfo& info);

/// Returns a sentence to print: the device, where pages are, and why.
std::string describeGlPages(GlPages asked, const GlInfo& info);

} // namespace shadowdag
