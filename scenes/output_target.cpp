// SPDX-License-Identifier: Apache-2.0
#include "scenes/output_target.h"

#include "cuda/error.h"

#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>

namespace shadowdag {

std::string outputTarget(const std::string& path) {
    namespace fs = std::filesystem;
    std::error_code error;
    const fs::file_status status = fs::status(path, error);
    if (error == std::errc::too_many_symbolic_link_levels)
        throw Error(ErrorKind::kResource,
                    "cannot write '" + path + "': it is a loop of symbolic links; remove them");
    if (fs::exists(status) && !fs::is_regular_file(status) && !fs::is_directory(status))
        throw Error(ErrorKind::kResource, "cannot write '" + path +
                                              "': it is a pipe, a socket or a device, which a "
                                              "complete file would replace; name a regular file");
    fs::path target = path;
    while (fs::is_symlink(target, error)) { // ends, as there is no loop
        const fs::path folder = fs::canonical(fs::absolute(target).parent_path(), error);
        if (folder == "/dev" || folder.string().starts_with("/proc/"))
            throw Error(ErrorKind::kResource,
                        "cannot write '" + path +
                            "': it is a link of the system to an open file, as /dev/stdout is, "
                            "which a complete file would replace; name a regular file");
        target = target.parent_path() / fs::read_symlink(target);
    }
    if (fs::exists(status) && !target.extension().empty() &&
        target.extension() != fs::path(path).extension())
        throw Error(ErrorKind::kResource,
                    "cannot write '" + path + "': it is a link to '" + target.string() +
                        "', a file of another kind; name that file, or remove "
                        "the link");
    struct stat found {};
    if (::stat(target.c_str(), &found) == 0 && S_ISREG(found.st_mode)) {
        constexpr mode_t kAnyWriter = S_IWUSR | S_IWGRP | S_IWOTH;
        const bool isReadOnly = (found.st_mode & kAnyWriter) == 0; // root may write it, too
        if (isReadOnly || ::access(target.c_str(), W_OK) != 0)
            throw Error(ErrorKind::kResource,
                        "cannot replace '" + path +
                            "': " + (isReadOnly ? "it is read-only" : std::strerror(errno)) +
                            "; make it writable (chmod u+w) or name another file");
    }
    return target.string();
}

} // namespace shadowdag
