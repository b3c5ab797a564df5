// SPDX-License-Identifier: Apache-2.0
#include "tools/commands/exit_message.h"

#include "cuda/error.h"
#include "cuda/thread_refusal.h"
#include "scenes/input_file.h"
#include "scenes/write_remedy.h"

#include <cerrno>
#include <filesystem>
#include <new>
#include <stdexcept>
#include <system_error>

namespace shadowdag {

ExitMessage exitMessageOf(const std::exception& exception) {
    if (const auto* error = dynamic_cast<const Error*>(&exception))
        return {error->what(), int(error->kind())};
    if (dynamic_cast<const std::bad_alloc*>(&exception))
        return {"not enough memory; try a smaller --size, --resolution or --pool, or fewer frames",
                int(ErrorKind::kResource)};
    if (saysNoThread(exception))
        return {std::string("the system refuses a thread or memory for one: ") + exception.what() +
                    "; raise the limits of the shell (ulimit -u, ulimit -v) or use fewer "
                    "--threads",
                int(ErrorKind::kResource)};
    // Of the file system, from the standard library.
    if (const auto* failed = dynamic_cast<const std::system_error*>(&exception))
        for (const int full : {ENOSPC, EIO, EROFS, EFBIG, EDQUOT})
            if (failed->code().value() == full)
                return {std::string(exception.what()) + "; " + writeRemedy(full),
                        int(ErrorKind::kResource)};
    // Of any library, and of the file system.
    if (saysTooManyFiles(exception.what()))
        return {std::string(exception.what()) + "; " + kMoreFilesRemedy, int(ErrorKind::kResource)};
    if (const auto* file = dynamic_cast<const std::filesystem::filesystem_error*>(&exception))
        return {file->path1().string() + (file->path2().empty() ? "" : " to ") +
                    file->path2().string() + ": " + file->code().message() + "; check the name",
                int(ErrorKind::kInput)};
    if (dynamic_cast<const std::logic_error*>(&exception))
        return {std::string("a defect of shadowdag, not of the input: ") + exception.what() +
                    "; please report it with the command line",
                kDefectExitStatus};
    return {exception.what(), int(ErrorKind::kInput)};
}

} // namespace shadowdag
