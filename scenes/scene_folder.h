// SPDX-License-Identifier: Apache-2.0
// Reads a scene's file, and the files that it names: only those in its folder, unless others are
// allowed.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace shadowdag {

/// The most that a scene's file or a file that it names may have: what a binary glTF file can say
/// of itself.
constexpr uint64_t kMaxSceneFileBytes = 0xffffffffu;

/// Sets whether files that a scene names (buffers, images, materials) may lie outside of its own
/// folder, by ".." or an absolute name or behind a symbolic link. For the whole process; false at
/// first, because a scene of unknown origin could then name any file of the user.
void allowOutsideFiles(bool isAllowed);

/// Returns the content of a scene's file. Throws Error kInput unless it is a regular file with
/// content that can be read, of at most kMaxSceneFileBytes.
std::vector<uint8_t> readSceneBytes(const std::string& path);

/// The folder of a scene's file. Libraries join it with the names of the files in it: a joined path
/// is path(), a slash and the name as the file states it.
class SceneFolder {
public:
    explicit SceneFolder(const std::string& scenePath);

    /// Returns the folder; "." where the scene's path has none.
    const std::string& path() const { return path_; }

    std::string join(const std::string& name) const;
    /// Returns the name in a joined path; of another path the whole.
    std::string nameOf(const std::string& joined) const;
    /// Returns the path of the file that a joined path means: an absolute name replaces the folder.
    std::string filePathOf(const std::string& joined) const;

    /// Returns why a joined path is not read, whether or not there is a file: its name holds a zero
    /// byte, at which the system would end it, is an address, or leads out of the folder: it is
    /// absolute, contains "..", or is or passes a symbolic link to elsewhere. "" if it is read.
    std::string refusalOf(const std::string& joined) const;
    /// Returns why the file of a path that is not refused is not read; "" if it is.
    std::string whyNoFile(const std::string& filePath) const;
    /// Returns why a file is missing where the scene's path is a link, whose own folder is
    /// searched; "" if it is none.
    std::string whyMissingBesideLink() const;

    /// Returns the content of a joined path, or nothing and in `why` the reason.
    std::optional<std::vector<uint8_t>> read(const std::string& joined, std::string& why) const;

private:
    std::string scenePath_, path_;
};

} // namespace shadowdag
