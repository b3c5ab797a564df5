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

/// A triangle whose corners follow joint 0, joint 1 and both by 1 to 3. Joint 0 (node 1) stands at
/// x = 10, joint 1 (node 2, below it) 5 higher, rising by 8 within 2 s. The inverse bind matrices
/// take 1 from z at joint 1.
GltfParts skinnedFile();

/// A triangle with two targets, which move corner 1 by (0, 0, 4) and every corner by (8, 0, 0).
/// Weights go from (0, 1) to (1, 0.5) within 2 s.
GltfParts morphedFile();

/// Returns the scene of a file that must be read, and be sound.
Scene readParts(const GltfParts& parts);

/// Returns the mask of a material as rows of # and ., from the top, with / between them; "opaque"
/// if it has none.
std::string maskOf(const Scene& scene, size_t material);

/// Fails the current test when an index is out of range, the nodes are no forest or a number is not
/// finite: what Scene promises.
void expectSound(const Scene& scene, const std::string& name);

/// Returns the shared scenes' folder with a trailing slash, or an empty string where there is none.
std::string sharedScenes();

} // namespace shadowdag::test
