// SPDX-License-Identifier: Apache-2.0
#include "scenes/output_target.h"

#include "cuda/error.h"
#include "scenes/write_remedy.h"

#include <unistd.h>

#include <filesystem>
#include <system_error>

namespace shadowdag {

namespace {

/// Throws Error kResource where the names of unfinished files would be too long.
void refuseTooLong(const std::filesystem::path& target, const std::string& path) {
    constexpr size_t kMostBytes = PATH_MAX - 1 - kScratchPathBytes - kTemporarySuffixBytes;
    const std::string folder = target.has_parent_path() ? target.parent_path().string() : ".";
    const size_t nameBytes = outputNameBytes(::pathconf(folder.c_str(), _PC_NAME_MAX));
    const bool isName = target.filename().string().size() > nameBytes;
    if (isName || target.string().size() > kMostBytes)
        throw Error(ErrorKind::kResource,
                    "cannot write '" + path + "': File name too long; choose a " +
                        (isName ? "name of at most " + std::to_string(nameBytes)
                                : "path of at most " + std::to_string(kMostBytes)) +
                        " bytes, so that unfinished files, whose names are longer, have room");
}

} // namespace

void refuseFileAsFolder(const std::string& path) {
    namespace fs = std::filesystem;
    std::error_code ignored;
    fs::path folder = fs::path(path).parent_path();
    while (folder.has_relative_path() && !fs::exists(fs::status(folder, ignored)))
        folder = folder.parent_path();
    if (folder.has_relative_path() && !fs::is_directory(folder, ignored))
        throw Error(ErrorKind::kResource, "cannot write '" + path + "': '" + folder.string() +
                                              "' is a file, not a folder; choose another place");
}

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
    if (fs::is_directory(status))
        return target.string();
    refuseFileAsFolder(target);
    refuseTooLong(target, path);
    if (fs::is_regular_file(status)) {
        std::string why = whyNotWritable(target);
        if (why.empty())
            why = whyNotReplaceable(target);
        if (!why.empty())
            throw Error(ErrorKind::kResource, "cannot replace '" + path + "': " + why);
    }
    return target.string();
}

} // namespace shadowdag
