// SPDX-License-Identifier: Apache-2.0
// Compares the results of passes on two backends: integers, and floats from which integers are
// computed, bit for bit, other floats within a stated tolerance.
#pragma once

#include "cuda/buffer.h"

#include <glm/glm.hpp>

#include <cmath>
#include <cstdio>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

namespace shadowdag {

/// Arrays in the order in which passes wrote them, on the host, so that the first that differs
/// names the pass at fault; what follows may differ because of it.
class Snapshot {
public:
    struct Array {
        std::string name;
        size_t elementWords; ///< 32-bit words that an element takes
        std::vector<uint32_t> words;
        double
            tolerance; ///< of floats, relative to the larger of 1 and the value; < 0: bit for bit
    };

    /// Adds an array that must be the same bit for bit. T must have no padding.
    template <class T> void add(const std::string& name, const std::vector<T>& host) {
        static_assert(std::is_trivially_copyable_v<T>);
        if constexpr (sizeof(T) < sizeof(uint32_t)) {
            arrays_.push_back({prefix_ + name, 1, {host.begin(), host.end()}, -1});
        } else {
            static_assert(sizeof(T) % sizeof(uint32_t) == 0);
            addWords(name, host.data(), host.size(), sizeof(T) / sizeof(uint32_t), -1);
        }
    }
    template <class T> void add(const std::string& name, const Buffer<T>& buffer) {
        add(name, buffer.download());
    }
    /// Adds one number.
    void add(const std::string& name, uint64_t value) { add(name, std::vector<uint64_t>{value}); }
    /// Adds floats that may differ by `tolerance` times the larger of 1 and the expected value.
    void addNear(const std::string& name, const std::vector<glm::vec3>& host, double tolerance) {
        addWords(name, host.data(), host.size(), 3, tolerance);
    }
    void addNear(const std::string& name, const std::vector<float>& host, double tolerance) {
        addWords(name, host.data(), host.size(), 1, tolerance);
    }
    /// Puts `prefix` before the names of what is added from here on.
    void under(std::string prefix) { prefix_ = std::move(prefix); }

    const std::vector<Array>& arrays() const { return arrays_; }

private:
    void addWords(const std::string& name, const void* data, size_t count, size_t elementWords,
                  double tolerance) {
        Array array{prefix_ + name, elementWords, std::vector<uint32_t>(count * elementWords),
                    tolerance};
        if (count > 0)
            std::memcpy(array.words.data(), data, array.words.size() * sizeof(uint32_t));
        arrays_.push_back(std::move(array));
    }

    std::string prefix_;
    std::vector<Array> arrays_;
};

/// Returns whether a word is as expected; floats with a tolerance may be both NaN, and infinities
/// must be equal.
inline bool isWordWithin(uint32_t expected, uint32_t actual, double tolerance) {
    if (expected == actual)
        return true;
    if (tolerance < 0)
        return false;
    float e, a;
    std::memcpy(&e, &expected, sizeof e);
    std::memcpy(&a, &actual, sizeof a);
    if (std::isnan(e) || std::isnan(a))
        return std::isnan(e) && std::isnan(a);
    if (std::isinf(e) || std::isinf(a))
        return e == a;
    return std::abs(double(e) - double(a)) <= tolerance * std::max(1.0, std::abs(double(e)));
}

/// Returns "" where two snapshots agree, else what differs: the first array that does, how many of
/// its elements, the first of these with both values, and how many arrays after it differ as well.
inline std::string firstDifference(const Snapshot& expected, const Snapshot& actual) {
    std::string text;
    size_t more = 0;
    if (expected.arrays().size() != actual.arrays().size())
        return std::to_string(actual.arrays().size()) + " arrays instead of " +
               std::to_string(expected.arrays().size());
    for (size_t k = 0; k < expected.arrays().size(); ++k) {
        const Snapshot::Array &e = expected.arrays()[k], &a = actual.arrays()[k];
        if (e.name != a.name)
            return "array '" + a.name + "' instead of '" + e.name + "'";
        std::string found;
        if (e.words.size() != a.words.size()) {
            found = "'" + e.name + "' has " + std::to_string(a.words.size() / a.elementWords) +
                    " elements instead of " + std::to_string(e.words.size() / e.elementWords);
        } else {
            size_t count = 0, first = 0, last = ~size_t(0);
            for (size_t w = 0; w < e.words.size(); ++w)
                if (!isWordWithin(e.words[w], a.words[w], e.tolerance)) {
                    const size_t element = w / e.elementWords;
                    first = count == 0 ? w : first;
                    count += element != last;
                    last = element;
                }
            if (count > 0) {
                char values[64];
                std::snprintf(values, sizeof values, "%08x instead of %08x", a.words[first],
                              e.words[first]);
                found = "'" + e.name + "' differs in " + std::to_string(count) + " of " +
                        std::to_string(e.words.size() / e.elementWords) + " elements, first in " +
                        std::to_string(first / e.elementWords) + " (word " +
                        std::to_string(first % e.elementWords) + "): " + values;
            }
        }
        if (found.empty())
            continue;
        if (text.empty())
            text = found;
        else
            ++more;
    }
    return more == 0 ? text : text + "; " + std::to_string(more) + " later arrays differ as well";
}

} // namespace shadowdag
