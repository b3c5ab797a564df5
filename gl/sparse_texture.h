// SPDX-License-Identifier: Apache-2.0
// A texture of many layers with memory only where pages are committed: ARB_sparse_texture. The
// context that the texture was created with must be current in every call.
#pragma once

#include <cstdint>
#include <string>

namespace shadowdag {

/// Owns `layers` square pictures of one number per texel, without memory at first. Writes to places
/// without memory are dropped; reads there are undefined.
class GlSparseArray {
public:
    /// Returns the side of a page of such textures in texels, 0 where the extension is absent or
    /// pages are not square.
    static uint32_t pageTexels();
    /// Returns whether the device reads back what it draws into their layers; found by drawing.
    /// (Mesa 25.0's lavapipe treats the attachment as one without pages.)
    static bool canBeDrawnInto(const std::string& layerExtension);

    /// The type of a texel. Drivers copy a texture, with all its address space, to read it as
    /// another type.
    enum Texel {
        kFloat, ///< R32F: to be drawn into
        kBits,  ///< R32UI, the bits of floats: for atomics
    };
    enum Memory {
        kSparse,
        kDense ///< fully allocated from the beginning, commits do nothing: for tests
    };
    /// @param side a multiple of the page's side. Throws Error kResource if it cannot be created.
    GlSparseArray(uint32_t side, uint32_t layers, uint32_t pageTexels, Texel texel,
                  Memory memory = kSparse);
    ~GlSparseArray();
    GlSparseArray(const GlSparseArray&) = delete;
    GlSparseArray& operator=(const GlSparseArray&) = delete;

    /// Commits `count` pages from page (x, y) of a layer on, along a row, or frees them.
    void commit(uint32_t layer, uint32_t x, uint32_t y, uint32_t count, bool isCommitted);

    /// Copies `count` pages from page (x, y) of a layer on, along a row, from another texture of
    /// the same side, pages and texels; they have memory in both.
    void copyPages(const GlSparseArray& from, uint32_t layer, uint32_t x, uint32_t y,
                   uint32_t count);

    /// Makes all layers the target, of which a vertex shader's gl_Layer chooses one, side x side
    /// pixels: the greatest value is kept.
    void bindTarget();
    /// Binds it to a texture unit.
    void bindTexture(uint32_t unit) const;
    /// Binds it to image unit 0, in the format of its texels.
    void bindImage() const;

    uint32_t side() const { return side_; }

private:
    uint32_t side_, pageTexels_;
    Texel texel_;
    Memory memory_;
    uint32_t texture_ = 0, framebuffer_ = 0;
};

} // namespace shadowdag
