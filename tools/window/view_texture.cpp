// SPDX-License-Identifier: Apache-2.0
#include "tools/window/view_texture.h"

#include <epoxy/gl.h>

namespace shadowdag {

ViewTexture::~ViewTexture() {
    if (name_ != 0)
        glDeleteTextures(1, &name_);
}

void ViewTexture::set(const std::vector<uint8_t>& rgba, uint32_t width, uint32_t height) {
    if (name_ == 0) {
        glGenTextures(1, &name_);
        glBindTexture(GL_TEXTURE_2D, name_);
        // Nearest: the displayed pixels are the rendered ones.
        glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
        glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
        glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
        glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    }
    glBindTexture(GL_TEXTURE_2D, name_);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    if (width == width_ && height == height_) {
        glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, int(width), int(height), GL_RGBA, GL_UNSIGNED_BYTE,
                        rgba.data());
    } else {
        glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, int(width), int(height), 0, GL_RGBA,
                     GL_UNSIGNED_BYTE, rgba.data());
        width_ = width;
        height_ = height;
    }
}

} // namespace shadowdag
