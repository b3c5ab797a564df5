// SPDX-License-Identifier: Apache-2.0
// Inputs as files, for readers that take a path.
#pragma once

#include <unistd.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>

namespace shadowdag::fuzz {

/// A folder of this process, in memory where the system has such a place, removed at its end.
class FuzzFolder {
public:
    FuzzFolder() {
        const std::filesystem::path memory = "/dev/shm";
        path_ = (std::filesystem::is_directory(memory) ? memory
                                                       : std::filesystem::temp_directory_path()) /
                ("sdag-fuzz-" + std::to_string(getpid()));
        std::filesystem::create_directories(path_);
    }
    ~FuzzFolder() {
        std::error_code ignored;
        std::filesystem::remove_all(path_, ignored);
    }
    FuzzFolder(const FuzzFolder&) = delete;
    FuzzFolder& operator=(const FuzzFolder&) = delete;

    /// Writes a file and returns its path.
    std::string write(const std::string& name, const uint8_t* data, size_t size) const {
        const std::string path = path_ / name;
        std::ofstream(path, std::ios::binary | std::ios::trunc)
            .write(reinterpret_cast<const char*>(data), std::streamsize(size));
        return path;
    }
    std::string path() const { return path_; }

private:
    std::filesystem::path path_;
};

/// Returns the folder of this process.
inline const FuzzFolder& fuzzFolder() {
    static const FuzzFolder folder;
    return folder;
}

/// Returns the content of a file of the source tree.
inline std::string sourceText(const std::string& path) {
    std::ifstream in(std::filesystem::path(SDAG_SOURCE_DIR) / path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

} // namespace shadowdag::fuzz
