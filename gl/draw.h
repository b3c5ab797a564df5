// SPDX-License-Identifier: Apache-2.0
// Render targets, and drawing triangles by lists of commands. The context that the objects were
// created with must be current in every call.
#pragma once

#include "gl/buffer.h"
#include "gl/program.h"

namespace shadowdag {

/// A command of glMultiDrawArraysIndirect: vertices [first, first + vertexCount), once. The vertex
/// shader gets `item` as attribute 0, an unsigned integer (GlCommands).
struct GlCommand {
    uint32_t vertexCount;
    uint32_t instanceCount = 1;
    uint32_t first;
    uint32_t item;
};
static_assert(sizeof(GlCommand) == 16);

/// A list of commands with the buffers that draw them.
class GlCommands {
public:
    explicit GlCommands(const std::string& name);
    ~GlCommands();
    GlCommands(const GlCommands&) = delete;
    GlCommands& operator=(const GlCommands&) = delete;

    /// Replaces the list. Items are below its length.
    void set(const std::vector<GlCommand>& commands);
    /// Draws triangles by commands [begin, end) of the list into the bound framebuffer.
    void draw(const GlProgram& program, uint32_t begin, uint32_t end) const;
    uint32_t count() const { return count_; }

private:
    GlBuffer commands_, items_;
    uint32_t array_ = 0, count_ = 0, itemCount_ = 0;
};

/// A framebuffer without attachments, of width x height pixels: fragments write buffers.
class GlNoTarget {
public:
    GlNoTarget();
    ~GlNoTarget();
    GlNoTarget(const GlNoTarget&) = delete;
    GlNoTarget& operator=(const GlNoTarget&) = delete;

    /// Makes it the target: no depth test, no blending, both sides of triangles, clip depth 0..1.
    void bind(int width, int height);

private:
    uint32_t framebuffer_ = 0;
};

/// A picture of one unsigned integer per pixel, with depth.
class GlIndexTarget {
public:
    GlIndexTarget();
    ~GlIndexTarget();
    GlIndexTarget(const GlIndexTarget&) = delete;
    GlIndexTarget& operator=(const GlIndexTarget&) = delete;

    /// Makes it the target, all pixels `clear` and depth 0: greater depths win, and the first of
    /// equal ones.
    void bind(int width, int height, uint32_t clear);
    /// Returns the pixels, the row of window coordinate 0 first.
    void read(std::vector<uint32_t>& pixels) const;

private:
    void release();

    int width_ = 0, height_ = 0;
    uint32_t framebuffer_ = 0, color_ = 0, depth_ = 0;
};

} // namespace shadowdag
