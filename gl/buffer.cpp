// SPDX-License-Identifier: Apache-2.0
#include "gl/buffer.h"

#include "cuda/buffer.h"
#include "gl/context.h"

#include <epoxy/gl.h>

#include <atomic>

namespace shadowdag {

namespace {

std::atomic<uint64_t> uploadCount{0}, readbackCount{0};

uint64_t storageLimit() {
    GLint64 limit = 0;
    glGetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &limit);
    return uint64_t(limit);
}

} // namespace

HostCopyCounts glCopyCounts() {
    return {uploadCount.load(), readbackCount.load()};
}

void detail::countGlReadback(uint64_t bytes) {
    readbackCount += bytes > 0;
}

GlBuffer::~GlBuffer() {
    if (!object_)
        return;
    glDeleteBuffers(1, &object_);
    detail::noteBytes(Backend::kGl, name_, -int64_t(capacity_));
}

void GlBuffer::allocate(uint64_t capacity, bool keeps) {
    const auto refuse = [&](const std::string& why) {
        throw Error(ErrorKind::kResource,
                    "OpenGL buffer '" + name_ + "' needs " + std::to_string(capacity) + " bytes, " +
                        why +
                        "; lower the resolution or the memory budget, or use another "
                        "backend");
    };
    if (const uint64_t limit = storageLimit(); capacity > limit)
        refuse("but shaders reach " + std::to_string(limit) + " of one buffer here");
    checkGl(
        "work before a buffer grew"); // otherwise an earlier error would be attributed to this call
    GLuint object = 0;
    glCreateBuffers(1, &object);
    glNamedBufferStorage(object, GLsizeiptr(capacity), nullptr, GL_DYNAMIC_STORAGE_BIT);
    if (const GLenum error = glGetError(); error != GL_NO_ERROR) {
        glDeleteBuffers(1, &object);
        refuse(error == GL_OUT_OF_MEMORY
                   ? "which are not available"
                   : "which OpenGL refused with error " + std::to_string(error));
    }
    if (keeps && object_ && bytes_)
        glCopyNamedBufferSubData(object_, object, 0, 0, GLsizeiptr(bytes_));
    if (object_) {
        glDeleteBuffers(1, &object_);
        detail::noteBytes(Backend::kGl, name_, -int64_t(capacity_));
    }
    object_ = object;
    capacity_ = capacity;
    detail::noteBytes(Backend::kGl, name_, int64_t(capacity_));
}

void GlBuffer::resize(uint64_t bytes, bool keeps) {
    if (bytes > capacity_ || !object_) {
        const uint64_t grown = capacity_ + capacity_ / 2;
        const uint64_t most = storageLimit();
        uint64_t capacity = bytes > grown ? bytes : (grown < most ? grown : bytes);
        capacity = (capacity + 3) / 4 * 4;
        allocate(capacity < 4 ? 4 : capacity, keeps);
    }
    bytes_ = bytes;
}

void GlBuffer::fill(uint32_t word) {
    if (bytes_)
        glClearNamedBufferSubData(object_, GL_R32UI, 0, GLsizeiptr((bytes_ + 3) / 4 * 4),
                                  GL_RED_INTEGER, GL_UNSIGNED_INT, &word);
}

void GlBuffer::write(uint64_t offset, const void* data, uint64_t bytes) {
    SDAG_ASSERT(offset + bytes <= bytes_);
    uploadCount += bytes > 0;
    if (bytes)
        glNamedBufferSubData(object_, GLintptr(offset), GLsizeiptr(bytes), data);
}

void GlBuffer::read(void* data, uint64_t bytes) const {
    SDAG_ASSERT(bytes <= bytes_);
    if (bytes == 0)
        return;
    detail::countGlReadback(bytes);
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    glGetNamedBufferSubData(object_, 0, GLsizeiptr(bytes), data);
}

void GlBuffer::bindStorage(uint32_t binding) {
    if (!object_)
        resize(0);
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, binding, object_);
}

} // namespace shadowdag
