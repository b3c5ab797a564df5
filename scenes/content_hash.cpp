// SPDX-License-Identifier: Apache-2.0
#include "scenes/content_hash.h"

#include <xxhash.h>

#include <cstring>
#include <new>

namespace shadowdag {

namespace {

std::array<uint8_t, 16> canonicalHash(const XXH128_hash_t& value) {
    XXH128_canonical_t canonical;
    XXH128_canonicalFromHash(&canonical, value);
    std::array<uint8_t, 16> hash;
    std::memcpy(hash.data(), canonical.digest, hash.size());
    return hash;
}

} // namespace

std::array<uint8_t, 16> contentHash(const void* data, size_t byteCount) {
    return canonicalHash(XXH3_128bits(data, byteCount));
}

std::string hashText(const std::array<uint8_t, 16>& hash) {
    std::string text;
    for (const uint8_t byte : hash)
        for (const int digit : {byte >> 4, byte & 15})
            text += "0123456789abcdef"[digit];
    return text;
}

struct ContentHasher::State {
    XXH3_state_t* xxh = XXH3_createState();
    ~State() { XXH3_freeState(xxh); }
};

ContentHasher::ContentHasher() : state_(std::make_unique<State>()) {
    if (state_->xxh == nullptr)
        throw std::bad_alloc();
    XXH3_128bits_reset(state_->xxh);
}
ContentHasher::~ContentHasher() = default;
ContentHasher::ContentHasher(ContentHasher&&) noexcept = default;
ContentHasher& ContentHasher::operator=(ContentHasher&&) noexcept = default;

void ContentHasher::add(const void* data, size_t byteCount) {
    XXH3_128bits_update(state_->xxh, data, byteCount);
}

std::array<uint8_t, 16> ContentHasher::hash() const {
    return canonicalHash(XXH3_128bits_digest(state_->xxh));
}

} // namespace shadowdag
