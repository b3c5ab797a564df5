// SPDX-License-Identifier: Apache-2.0
// What a compare has finished so far, kept in its directory so that an interrupted one can go on.
#pragma once

#include "tools/settings/json.h"

#include <string>
#include <vector>

namespace shadowdag {

/// Returns a hash by name of what answers depend on beside the experiment: the program itself,
/// every scene (of a glTF file also the buffers and images that it refers to) and the further files
/// given (assets, costs). What cannot be read is "missing": whoever needs it will say so.
Json inputHashes(const std::vector<std::string>& scenes, const std::vector<std::string>& files);

/// Finished parts by name. Every save replaces the file as a whole.
class Journal {
public:
    /// @param path the file, "" to keep parts in memory alone; @param key what must be equal for
    /// parts to be valid: commit, experiment, ...
    /// @param resume false: starts empty and saves that; true: takes up the file when it is there.
    /// Throws Error kUsage when it has another key, kInput when it is damaged.
    Journal(std::string path, std::string key, bool resume);

    /// Returns the finished part, or null. Valid until the next set().
    const Json* find(const std::string& part) const;
    /// Remembers a part and saves the file. Throws Error kResource.
    void set(const std::string& part, Json value);
    size_t takenUpCount() const { return takenUpCount_; }

private:
    void save() const;

    std::string path_;
    Json content_;
    size_t takenUpCount_ = 0;
};

} // namespace shadowdag
