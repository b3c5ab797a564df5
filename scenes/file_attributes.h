// SPDX-License-Identifier: Apache-2.0
// What a file or a folder that replaces another takes over from it, besides its name.
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>

namespace shadowdag {

/// The owner and the rights of a file or a folder. Of a file without the set-id and sticky bits,
/// which were given to its old content alone.
struct FileAttributes {
    mode_t mode = 0;
    uid_t owner = 0;
    gid_t group = 0;
    std::string accessList;  ///< the ACL as the system stores it; "" if there is none
    std::string defaultList; ///< of a folder: the ACL of what is created in it

    /// Gives them to another file or folder, as far as this user may. Where the group or a list
    /// cannot be given, the group and others get only those rights that everybody had, so that
    /// nobody but this user gets more. Returns whether the mode was set; else errno says why not.
    bool giveTo(const std::string& path) const;
};

/// Returns the attributes of a file or a folder; nothing if there is none, or if this user may not
/// ask for them.
std::optional<FileAttributes> attributesOf(const std::string& path);

} // namespace shadowdag
