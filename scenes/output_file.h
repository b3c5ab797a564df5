// SPDX-License-Identifier: Apache-2.0
// A file that appears complete or not at all.
#pragma once

#include <cstddef>
#include <fstream>
#include <string>

namespace shadowdag {

/// Writes next to the final name and renames on commit(); destroyed without commit, it removes what
/// it wrote and leaves an old file of that name alone. Throws Error kResource naming path and
/// reason.
class OutputFile {
public:
    explicit OutputFile(std::string path);
    ~OutputFile();
    OutputFile(const OutputFile&) = delete;
    OutputFile& operator=(const OutputFile&) = delete;

    void write(const void* data, size_t byteCount);
    void write(const std::string& text) { write(text.data(), text.size()); }
    /// Returns where the bytes go for now, for libraries that open files by name themselves.
    const std::string& temporaryPath() const { return temporaryPath_; }
    /// Flushes to disk and renames. Call once, last.
    void commit();

private:
    std::string path_;
    std::string temporaryPath_;
    std::ofstream stream_;
    bool committed_ = false;
};

} // namespace shadowdag
