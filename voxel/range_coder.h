// SPDX-License-Identifier: Apache-2.0
// Binary arithmetic coding with adaptive probabilities. Encoder and decoder have the same `bit`, so
// that one text defines both coding and decoding.
// Source: Martin, Range encoding, 1979; carries and 32-bit steps of a 64-bit range are ours.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace shadowdag {

namespace detail {

/// After so many bits the past decays by 1/30 per bit. 60 and 255 gave larger files.
constexpr uint32_t kMostSeen = 30;

/// 2^16 / (seen + 1.6): how far a probability moves towards the next bit.
struct LearningRates {
    uint32_t at[kMostSeen + 1] = {};
    constexpr LearningRates() {
        for (uint32_t i = 0; i <= kMostSeen; ++i)
            at[i] = 655360u / (10 * i + 16);
    }
};
inline constexpr LearningRates kLearningRates;

} // namespace detail

/// The probability that a bit is 1, learned from the bits before it.
///
///     0..15  probability of 1, in 2^-16, never 0       16..23  bits seen, up to kMostSeen
///     24..31 free for the owner
struct AdaptiveBit {
    uint16_t chance = 32768;
    uint8_t seen = 0;
    uint8_t owners = 0;

    void learn(uint32_t bit) {
        const uint32_t rate = detail::kLearningRates.at[seen];
        if (bit)
            chance = uint16_t(chance + ((65535u - chance) * rate >> 16));
        else
            chance = uint16_t(chance - (chance * rate >> 16));
        seen = uint8_t(seen + (seen < detail::kMostSeen));
    }
};
static_assert(sizeof(AdaptiveBit) == 4);

class RangeEncoder {
public:
    /// Codes the bit; returns it.
    uint32_t bit(AdaptiveBit& model, uint32_t value) {
        code(model.chance, value);
        model.learn(value);
        return value;
    }
    /// The same for a bit with no context.
    uint32_t evenBit(uint32_t value) {
        code(32768, value);
        return value;
    }
    /// Returns the coded bytes; call once, last.
    std::vector<uint8_t> finish() {
        emit();
        emit();
        return std::move(bytes_);
    }

private:
    void code(uint32_t chance, uint32_t value) {
        const uint64_t ones = (range_ >> 16) * chance;
        if (value) {
            range_ = ones;
        } else {
            low_ += ones;
            range_ -= ones;
            if (low_ < ones) // carry: what was written is one too small
                for (size_t i = bytes_.size(); i-- > 0 && ++bytes_[i] == 0;) {
                }
        }
        if (range_ >> 32 == 0) {
            emit();
            range_ <<= 32;
        }
    }
    /// Writes the upper half of low_, its highest byte first.
    void emit() {
        for (int shift = 56; shift >= 32; shift -= 8)
            bytes_.push_back(uint8_t(low_ >> shift));
        low_ <<= 32;
    }

    std::vector<uint8_t> bytes_;
    uint64_t low_ = 0;
    uint64_t range_ = ~uint64_t(0);
};

/// Reads zeros past the end of its bytes.
class RangeDecoder {
public:
    RangeDecoder(const uint8_t* bytes, size_t byteCount) : next_(bytes), left_(byteCount) {
        fill();
        fill();
    }

    /// Returns the next bit. The argument is that of the encoder and is ignored.
    uint32_t bit(AdaptiveBit& model, uint32_t = 0) {
        const uint32_t value = decode(model.chance);
        model.learn(value);
        return value;
    }
    uint32_t evenBit(uint32_t = 0) { return decode(32768); }
    /// Returns whether more was read than was ever written.
    bool isPastEnd() const { return isPastEnd_; }

private:
    uint32_t decode(uint32_t chance) {
        const uint64_t ones = (range_ >> 16) * chance;
        const uint32_t value = code_ < ones;
        code_ -= value ? 0 : ones;
        range_ = value ? ones : range_ - ones;
        if (range_ >> 32 == 0) {
            fill();
            range_ <<= 32;
        }
        return value;
    }
    void fill() {
        for (int i = 0; i < 4; ++i) {
            isPastEnd_ = isPastEnd_ || left_ == 0;
            code_ = code_ << 8 | (left_ > 0 ? *next_ : 0u);
            next_ += left_ > 0;
            left_ -= left_ > 0;
        }
    }

    const uint8_t* next_;
    size_t left_;
    bool isPastEnd_ = false;
    uint64_t code_ = 0;
    uint64_t range_ = ~uint64_t(0);
};

} // namespace shadowdag
