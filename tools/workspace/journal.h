// SPDX-License-Identifier: Apache-2.0
// The finished parts of a compare or a study, stored in its directory so that an interrupted one
// can be resumed.
#pragma once

#include "tools/settings/json.h"

#include <nlohmann/json.hpp>

#include <string>
#include <vector>

namespace shadowdag {

/// Returns hashes by name of the inputs of results besides the experiment: the program itself,
/// every scene (of a glTF file also the buffers and images that it refers to, of an OBJ file its
/// materials and their images, and what its reader reads where one of these is missing; of other
/// kinds the file alone) and the further files given (assets, costs). A file that cannot be read is
/// "missing"; its reader will report it.
Json inputHashes(const std::vector<std::string>& scenes, const std::vector<std::string>& files);

/// Returns the differences of two keys as text, each with the place and both values: "size was
/// \"48x27\" and is \"64x36\"; taps was 4 and is 9"; lists at most eight, then how many more there
/// are; "" if there is none.
std::string differenceText(const Json& before, const Json& now);

/// Finished parts by name. Every save replaces the whole file.
class Journal {
public:
    /// @param path the file, "" to keep parts in memory alone; @param key must be equal for parts
    /// to be valid: commit, experiment, ...; a message names the differences
    /// @param resume false: starts empty and saves that; true: reads the file if it exists, and
    /// leaves out parts that name a picture (*.png) which is not whole beside the file or in the
    /// folder `images` there. Throws Error kUsage when it has another key, kInput when it was
    /// damaged or edited.
    Journal(std::string path, Json key, bool resume);

    /// Returns the finished part, or null. Valid until the next set().
    const Json* find(const std::string& part) const;
    /// Stores a part and saves the file. Throws Error kResource.
    void set(const std::string& part, Json value);
    /// Returns how many parts were read.
    size_t takenUpCount() const { return takenUpCount_; }
    /// Returns how many parts were left out because their pictures are absent.
    size_t lostCount() const { return lostCount_; }

private:
    void save() const;

    std::string path_;
    Json content_;
    size_t takenUpCount_ = 0, lostCount_ = 0;
};

/// Returns what to tell of a journal that is resumed: how many parts are reused, how many measured
/// again; "" if it had none.
std::string remarkOn(const Journal& journal);

} // namespace shadowdag
