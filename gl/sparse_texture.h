// SPDX-License-Identifier: Apache-2.0
// A texture of many layers with memory only where pages are committed: ARB_sparse_texture. The
// context that the texture was created with must be current in every call.
#pragma once

#include <cstdint>
#include <string>

namespace shadowdag {

/// Owns `layers` square pictures of one number a texel, without memory at first. What is written
/// where there is none vanishes; what is read there is undefined.
class GlSparseArray {
public:
    /// Returns the side of a page of such textures in texels, 0 where the extension is absent or
    /// pages are not square.
    static uint32_t pageTexels();
    /// Returns whether the device draws into their layers what it reads there: asked by drawing.
    /// (Mesa 25.0's lavapipe takes the attachment for one without pages.)
    static bool canBeDrawnInto(const std::string& layerExtension);

    /// What a texel is. Drivers copy a texture, all its address space, to read it as another.
    enum Texel {
        kFloat, ///< R32F: to be drawn into
        kBits,  ///< R32UI, the bits of floats: for atomics
    };
    enum Memory {
        kSparse,
        kDense ///< all there from the beginning, commits do nothing: tests of whoever uses it
    };
    /// @param side a multiple of the page's side Throws Error kResource where it cannot be had.
    GlSparseArray(uint32_t side, uint32_t layers, uint32_t pageTexels, Texel texel,
                  Memory memory = kSparse);
    ~GlSparseArray();
    GlSparseArray(const GlSparseArray&) = delete;
    GlSparseArray& operator=(const GlSparseArray&) = delete;

    /// Gives `count` pages from page (x, y) of a layer on, along a row, memory, or takes it.
    void commit(uint32_t layer, uint32_t x, uint32_t y, uint32_t count, bool isCommitted);

    /// Copies `count` pages from page (x, y) of a layer on, along a row, from another texture of
    /// the same side, pages and texels; they have memory in both.
    void copyPages(const GlSparseArray& from, uint32_t layer, uint32_t x, uint32_t y,
                   uint32_t count);

    /// Makes all layers the target of what a vertex shader's gl_Layer chooses, side x side pixels:
    /// the greatest value stays.
    void bindTarget();
    /// Binds it to a texture unit.
    void bindTexture(uint32_t unit) const;
    /// Binds it to image unit 0, as what its texels are.
    void bindImage() const;

    uint32_t side() const { return side_; }

private:
    uint32_t side_, pageTexels_;
    Texel texel_;
    Memory memory_;
    uint32_t texture_ = 0, framebuffer_ = 0;
};

} // namespace shadowdag
