// SPDX-License-Identifier: Apache-2.0
#include "tools/workspace/directory_lock.h"

#include "cuda/error.h"
#include "scenes/input_file.h"

#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>
#include <utility>

namespace shadowdag {

DirectoryLock::DirectoryLock(const std::string& option, const std::string& directory)
    : descriptor_(open(directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
    if (descriptor_ < 0) {
        const int failure = errno;
        refuseTooManyFiles(directory, failure);
        throw Error(ErrorKind::kResource, directory +
                                              ": cannot be opened: " + std::strerror(failure) +
                                              "; choose another directory");
    }
    if (flock(descriptor_, LOCK_EX | LOCK_NB) == 0)
        return;
    const int failure = errno;
    close(descriptor_);
    if (failure == EWOULDBLOCK)
        throw Error(ErrorKind::kResource,
                    option + " '" + directory +
                        "': another shadowdag is writing there; wait for it or "
                        "choose another directory");
    throw Error(ErrorKind::kResource, directory + ": cannot be locked: " + std::strerror(failure) +
                                          "; choose a directory on another file system");
}

DirectoryLock::DirectoryLock(DirectoryLock&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)) {}

DirectoryLock::~DirectoryLock() {
    if (descriptor_ >= 0)
        close(descriptor_);
}

} // namespace shadowdag
