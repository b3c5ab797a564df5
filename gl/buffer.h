// SPDX-License-Identifier: Apache-2.0
// Named arrays in OpenGL's memory, recorded in the ledger of cuda/buffer.h. The context that the
// buffer was created with must be current in every call.
#pragma once

#include "cuda/view.h"

#include <string>
#include <vector>

namespace shadowdag {

struct HostCopyCounts;

/// Returns how often the host has copied to OpenGL (GlBuffer's upload and write) and from it
/// (download, read, and pictures) since the program began. Copies of nothing do not count.
HostCopyCounts glCopyCounts();

namespace detail {
void countGlReadback(uint64_t bytes);
}

/// Owns `bytes` of memory that shaders read and write. Move-only. Grows geometrically through
/// resize and never shrinks its capacity.
class GlBuffer {
public:
    explicit GlBuffer(std::string name) : name_(std::move(name)) {}
    ~GlBuffer();
    GlBuffer(const GlBuffer&) = delete;
    GlBuffer& operator=(const GlBuffer&) = delete;

    /// Makes it hold so many bytes; contents are lost when it has to grow, unless `keeps`. Throws
    /// Error kResource naming the buffer when OpenGL cannot hold it, or shaders could not reach it.
    void resize(uint64_t bytes, bool keeps = false);
    /// Sets every 32-bit word.
    void fill(uint32_t word);
    /// Resizes to the host's elements and copies them here.
    template <class T> void upload(View<const T> host) {
        resize(host.count * sizeof(T));
        write(0, host.data, host.count * sizeof(T));
    }
    template <class T> void upload(const std::vector<T>& host) { upload(viewOf(host)); }
    void write(uint64_t offset, const void* data, uint64_t bytes);
    /// Copies to the host, after all queued work. @param bytes at most as many as it holds
    void read(void* data, uint64_t bytes) const;
    template <class T> std::vector<T> download() const {
        std::vector<T> host(bytes_ / sizeof(T));
        read(host.data(), host.size() * sizeof(T));
        return host;
    }
    /// Binds all of it as shader storage; an empty buffer gets one word, because OpenGL binds no
    /// empty range.
    void bindStorage(uint32_t binding);
    uint64_t bytes() const { return bytes_; }
    uint32_t name() const { return object_; } ///< OpenGL's; 0 before the first resize

private:
    void allocate(uint64_t capacity, bool keeps);

    std::string name_;
    uint32_t object_ = 0;
    uint64_t bytes_ = 0, capacity_ = 0;
};

} // namespace shadowdag
