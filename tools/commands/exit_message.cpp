// SPDX-License-Identifier: Apache-2.0
#include "tools/commands/exit_message.h"

#include "cuda/error.h"

#include <new>
#include <stdexcept>

namespace shadowdag {

ExitMessage exitMessageOf(const std::exception& exception) {
    if (const auto* error = dynamic_cast<const Error*>(&exception))
        return {error->what(), int(error->kind())};
    if (dynamic_cast<const std::bad_alloc*>(&exception))
        return {"not enough memory; try a smaller --size, --resolution or --pool, or fewer frames",
                int(ErrorKind::kResource)};
    if (dynamic_cast<const std::logic_error*>(&exception))
        return {std::string("a defect of shadowdag, not of the input: ") + exception.what() +
                    "; please report it with the command line",
                kDefectExitStatus};
    return {exception.what(), int(ErrorKind::kInput)};
}

} // namespace shadowdag
