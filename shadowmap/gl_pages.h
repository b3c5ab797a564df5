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
};

/// Chooses what renderers made from now on have, for the whole process; kAuto at first.
void setGlPages(GlPages pages);
/// Returns what was asked for last.
GlPages askedGlPages();

/// Returns what `asked` comes to on a device: kSparse or kAtlas. Throws Error kDevice for kSparse
/// where there are no sparse textures with square pages.
GlPages chooseGlPages(GlPages asked, const GlInfo& info);

/// Returns a sentence for people: the device, where pages are, and why.
std::string describeGlPages(GlPages asked, const GlInfo& info);

} // namespace shadowdag
