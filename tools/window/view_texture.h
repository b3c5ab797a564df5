// SPDX-License-Identifier: Apache-2.0
// A texture for showing a picture.
#pragma once

#include <cstdint>
#include <vector>

namespace shadowdag {

/// An RGBA texture of the current OpenGL context; it must be current wherever this is used.
class ViewTexture {
public:
    ViewTexture() = default;
    ~ViewTexture();
    ViewTexture(const ViewTexture&) = delete;
    ViewTexture& operator=(const ViewTexture&) = delete;

    /// Takes width * height * 4 bytes over, rows from the top.
    void set(const std::vector<uint8_t>& rgba, uint32_t width, uint32_t height);
    unsigned name() const { return name_; }
    bool empty() const { return width_ == 0; }

private:
    unsigned name_ = 0;
    uint32_t width_ = 0, height_ = 0;
};

} // namespace shadowdag
