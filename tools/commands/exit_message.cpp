// SPDX-License-Identifier: Apache-2.0
#include "tools/commands/exit_message.h"

#include "cuda/error.h"

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
    if (const auto* failed = dynamic_cast<const std::system_error*>(&exception))
        if (failed->code() == std::errc::resource_unavailable_try_again ||
            failed->code() == std::errc::not_enough_memory)
            return {std::string("the system refuses a thread or memory for one: ") +
                        failed->what() +
                        "; raise the limits of the shell (ulimit -u, ulimit -v) or use fewer "
                        "--threads",
                    int(ErrorKind::kResource)};
    if (dynamic_cast<const std::logic_error*>(&exception))
        return {std::string("a defect of shadowdag, not of the input: ") + exception.what() +
                    "; please report it with the command line",
                kDefectExitStatus};
    return {exception.what(), int(ErrorKind::kInput)};
}

} // namespace shadowdag
