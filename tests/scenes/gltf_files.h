// SPDX-License-Identifier: Apache-2.0
// Small glTF files made by the tests themselves, one part of which can be broken at a time.
#pragma once

#include "scenes/scene.h"

#include <cstdint>
#include <cstring>
#include <map>
#include <string>
#include <vector>

namespace shadowdag::test {

/// A folder that vanishes with the object.
class TemporaryFolder {
public:
    TemporaryFolder();
    ~TemporaryFolder();
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;
    std::string path(const std::string& name) const { return path_ + "/" + name; }
    std::string write(const std::string& name, const std::string& content) const;

private:
    std::string path_;
};

/// The top-level members of a glTF file and its binary chunk.
struct GltfParts {
    std::map<std::string, std::string> members;
    std::string binary;

    template <class T> GltfParts& append(const std::vector<T>& values) {
        const size_t bytes = values.size() * sizeof(T);
        const size_t at = binary.size();
        binary.resize(at + bytes);
        std::memcpy(binary.data() + at, values.data(), bytes);
        return *this;
    }
    GltfParts& set(const std::string& member, const std::string& json) {
        members[member] = json;
        return *this;
    }
    std::string json() const;
    std::string glb() const; ///< padded as the format requires
};

/// Returns a valid file: one node, one triangle (0 0 0), (2 0 0), (0 1 0) with indices of two
/// bytes. Positions are accessor 0 (buffer view 0, 36 bytes), indices accessor 1 (view 1, 6 bytes
/// at 36).
GltfParts triangleFile();

/// Fails the current test when an index is out of range, the nodes are no forest or a number is not
/// finite: what Scene promises.
void expectSound(const Scene& scene, const std::string& name);

/// Returns the shared scenes' folder with a trailing slash, or an empty string where there is none.
std::string sharedScenes();

} // namespace shadowdag::test
