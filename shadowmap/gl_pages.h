// SPDX-License-Identifier: Apache-2.0
// Where the memory of shadow-map pages is in OpenGL.
#pragma once

#include "gl/context.h"

#include <string>

namespace shadowdag {

enum class GlPages {
    kAuto,   ///< sparse if the device has ARB_sparse_texture, else an atlas
    kSparse, ///< layers of sparse textures, pages committed by the driver (the paper)
    kAtlas,  ///< one pool, pages found by the page table
    /// Layers as kSparse has them, fully allocated: for tests on devices without
    /// ARB_sparse_texture.
    kDenseLayers,
};

/// Side of a page in dense layers, texels.
constexpr uint32_t kDensePageTexels = 128;

/// Sets the mode of renderers that are created later, for the whole process; initially kAuto.
void setGlPages(GlPages pages);
/// Returns the last requested mode.
GlPages requestedGlPages();

/// Returns the mode that `asked` resolves to on a device, never kAuto. Throws Error kDevice for
/// kSparse if the device has no sparse textures with square pages.
GlPages chooseGlPages(GlPages asked, const GlInfo& info);

/// Returns the page side that a device has for `pages`, which is not kAuto; 0: any side.
uint32_t glPageTexels(GlPages pages, const GlInfo& info);
/// Returns the same for the last requested mode, on the device that this process has. Throws Error
/// kDevice as chooseGlPages and glDeviceInfo do.
uint32_t requestedGlPageTexels();

/// Returns whether the device draws into maps as layers, which hold floats; otherwise fragments
/// write them by atomics. @param pages not kAuto
bool drawsLayers(GlPages pages, const GlInfo& info);

/// Returns a sentence to print: the device, the location of pages, and the reason.
std::string describeGlPages(GlPages asked, const GlInfo& info);

} // namespace shadowdag
