// SPDX-License-Identifier: Apache-2.0
// The item of a command reaches the vertex shader as an attribute that advances once per instance
// and starts at the command's base instance, because OpenGL 4.5 has no gl_DrawID.
#include "gl/draw.h"

#include "cuda/error.h"

#include <epoxy/gl.h>

#include <numeric>

namespace shadowdag {

namespace {

void setPlainState(int width, int height) {
    glViewport(0, 0, width, height);
    glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
    glDisable(GL_CULL_FACE);
    glDisable(GL_BLEND);
    glDisable(GL_DEPTH_TEST);
    glDisable(GL_DITHER);
}

void checkFramebuffer(GLuint framebuffer, const char* what) {
    const GLenum status = glCheckNamedFramebufferStatus(framebuffer, GL_DRAW_FRAMEBUFFER);
    if (status != GL_FRAMEBUFFER_COMPLETE)
        throw Error(ErrorKind::kDevice, std::string("OpenGL has no framebuffer for ") + what +
                                            " (status " + std::to_string(status) +
                                            "); use --backend cpu");
}

} // namespace

GlCommands::GlCommands(const std::string& name)
    : commands_(name + " commands"), items_(name + " items") {
    glCreateVertexArrays(1, &array_);
    glEnableVertexArrayAttrib(array_, 0);
    glVertexArrayAttribIFormat(array_, 0, 1, GL_UNSIGNED_INT, 0);
    glVertexArrayAttribBinding(array_, 0, 0);
    glVertexArrayBindingDivisor(array_, 0, 1);
}

GlCommands::~GlCommands() {
    glDeleteVertexArrays(1, &array_);
}

void GlCommands::set(const std::vector<GlCommand>& commands) {
    count_ = uint32_t(commands.size());
    commands_.upload(commands);
    if (itemCount_ < count_) {
        itemCount_ = count_ + count_ / 2;
        std::vector<uint32_t> items(itemCount_);
        std::iota(items.begin(), items.end(), 0u);
        items_.upload(items);
        glVertexArrayVertexBuffer(array_, 0, items_.name(), 0, sizeof(uint32_t));
    }
}

void GlCommands::draw(const GlProgram& program, uint32_t begin, uint32_t end) const {
    if (begin >= end)
        return;
    glUseProgram(program.name());
    glBindVertexArray(array_);
    glBindBuffer(GL_DRAW_INDIRECT_BUFFER, commands_.name());
    glMultiDrawArraysIndirect(GL_TRIANGLES,
                              reinterpret_cast<const void*>(uintptr_t(begin) * sizeof(GlCommand)),
                              GLsizei(end - begin), 0);
    glMemoryBarrier(GL_ALL_BARRIER_BITS);
    glBindVertexArray(0);
}

GlNoTarget::GlNoTarget() {
    glCreateFramebuffers(1, &framebuffer_);
}

GlNoTarget::~GlNoTarget() {
    glDeleteFramebuffers(1, &framebuffer_);
}

void GlNoTarget::bind(int width, int height) {
    glNamedFramebufferParameteri(framebuffer_, GL_FRAMEBUFFER_DEFAULT_WIDTH, width);
    glNamedFramebufferParameteri(framebuffer_, GL_FRAMEBUFFER_DEFAULT_HEIGHT, height);
    checkFramebuffer(framebuffer_, "fragments that write buffers");
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
    setPlainState(width, height);
}

GlIndexTarget::GlIndexTarget() {
    glCreateFramebuffers(1, &framebuffer_);
}

GlIndexTarget::~GlIndexTarget() {
    release();
    glDeleteFramebuffers(1, &framebuffer_);
}

void GlIndexTarget::release() {
    glDeleteTextures(1, &color_);
    glDeleteTextures(1, &depth_);
    color_ = depth_ = 0;
    width_ = height_ = 0; // the previous targets no longer exist
}

void GlIndexTarget::bind(int width, int height, uint32_t clear) {
    if (width != width_ || height != height_) {
        release();
        glCreateTextures(GL_TEXTURE_2D, 1, &color_);
        glTextureStorage2D(color_, 1, GL_R32UI, width, height);
        glCreateTextures(GL_TEXTURE_2D, 1, &depth_);
        glTextureStorage2D(depth_, 1, GL_DEPTH_COMPONENT32F, width, height);
        glNamedFramebufferTexture(framebuffer_, GL_COLOR_ATTACHMENT0, color_, 0);
        glNamedFramebufferTexture(framebuffer_, GL_DEPTH_ATTACHMENT, depth_, 0);
        checkFramebuffer(framebuffer_, "a picture of indices");
        width_ = width;
        height_ = height;
    }
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
    setPlainState(width, height);
    glEnable(GL_DEPTH_TEST);
    glDepthMask(GL_TRUE);
    glDepthFunc(GL_GREATER);
    const GLfloat farthest = 0.0f;
    glClearNamedFramebufferuiv(framebuffer_, GL_COLOR, 0, &clear);
    glClearNamedFramebufferfv(framebuffer_, GL_DEPTH, 0, &farthest);
}

void GlIndexTarget::read(std::vector<uint32_t>& pixels) const {
    pixels.resize(size_t(width_) * size_t(height_));
    detail::countGlReadback(pixels.size() * sizeof(uint32_t));
    glPixelStorei(GL_PACK_ALIGNMENT, 4);
    glGetTextureImage(color_, 0, GL_RED_INTEGER, GL_UNSIGNED_INT,
                      GLsizei(pixels.size() * sizeof(uint32_t)), pixels.data());
}

} // namespace shadowdag
